//! Links the C start-up code, which calls `main`.
fn main() {
    println!("cargo:rustc-link-arg=-lc");
}
