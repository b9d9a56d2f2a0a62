use camera_ingest::{overlay::*, source::*};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut s = open_video(std::path::Path::new(&a[1])).unwrap();
    let t = std::time::Instant::now();
    let frames = read_left(&mut s).unwrap();
    println!(
        "{} frames {:.2} ms each",
        frames.len(),
        t.elapsed().as_secs_f64() * 1e3 / frames.len() as f64
    );
    let pics: Vec<_> = a[3..]
        .iter()
        .map(|i| Picture::of(&frames[i.parse::<usize>().unwrap()]))
        .collect();
    contact_sheet(&pics, 2)
        .unwrap()
        .write_png(std::path::Path::new(&a[2]))
        .unwrap();
}
