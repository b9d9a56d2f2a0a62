//! `wag calib` with a printed board, which the shipped package finds.

#[path = "../../../camera-ingest/tests/printed_board/mod.rs"]
mod printed_board;

use super::images::{film_of, off};
use super::support::{are_refused_in, json_in};
use camera_ingest::calib::VideoMode;
use serde_json::Value;
use std::fs;

#[test]
fn a_board_tells_where_the_camera_stands() {
    let (board, truth) = (printed_board::board(), printed_board::camera());
    let frames = printed_board::film(&board, &truth, 1);
    let dir = film_of(&frames, &truth, VideoMode::Hd);
    let at = |name: &str| dir.path().join(name);
    fs::write(at("board.toml"), toml::to_string(&board).unwrap()).unwrap();
    let mut other = board.clone();
    other.dictionary = "DICT_9X9".to_owned();
    fs::write(at("other.toml"), toml::to_string(&other).unwrap()).unwrap();

    let film = "--video film_2560x720.yuyv --fps 30";
    let find = format!("calib extrinsics --camera thought.toml {film}");
    let found = format!("{find} --board board.toml --out found.toml");
    let report = json_in(dir.path(), &found);
    let (away_m, away_degrees) = off(&at("found.toml"), &truth);
    assert!(away_m <= 0.003 && away_degrees <= 0.2);
    let rms_px = |report: &Value| report["residual"]["rms_px"].as_f64().unwrap();
    assert!(rms_px(&report) < 0.3, "{report}");
    assert!(report["position_error_m"].as_f64().unwrap() > 0.0);

    let check = |camera: &str| format!("calib check --camera {camera} {film} --board board.toml");
    let report = json_in(dir.path(), &check("found.toml"));
    assert!(rms_px(&report) < 0.3, "{report}");
    for (camera, words) in [
        ("thought.toml", "wag calib extrinsics"),
        ("turned.toml", "sign is wrong"),
    ] {
        are_refused_in(dir.path(), 1, &format!("{} => {words}", check(camera)));
    }

    let refused = |shown: &str, words: &str| {
        let case = format!("{find} --out no.toml {shown} => {words}");
        are_refused_in(dir.path(), 2, &case);
    };
    refused("--board other.toml", "other.toml | DICT_9X9");
    refused("", "--board");
    refused("--lead shown.csv", "--lead-rgb");
    let lead = "--lead shown.csv --lead-rgb 240,150,30";
    fs::write(at("shown.csv"), "frame,x,y,z\n7,0,0,0\n").unwrap();
    refused(lead, "shown.csv | frame 7");
    fs::write(at("shown.csv"), "frame,x,y,z\n0,0,nan,0\n").unwrap();
    refused(lead, "shown.csv | finite");
}
