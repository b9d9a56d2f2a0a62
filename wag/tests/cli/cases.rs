//! Wrong command lines: one a line, with the words that must be in its error behind `=>`.
//! `|` stands between the words. They run in the folder of `files.rs`; `LINKS` is a model.

/// Exports and live sinks of this build, or what a build without them says.
pub(crate) const FEATURES: [&str; 3] = [
    if cfg!(feature = "ros2") {
        "export ros2 none.run => none.run | does not exist
        export ros2 . => ./run.mcap | no such file
        export ros2 notvideo.avi => notvideo.avi | not an MCAP file
        watch --ros2=300 => --ros2 | 232"
    } else {
        "export ros2 none.run => this build | --features ros2` | Debian package
        watch --ros2 => this build | --features ros2`"
    },
    if cfg!(feature = "foxglove") {
        "export foxglove none.run => none.run | does not exist"
    } else {
        "export foxglove none.run => this build | --features foxglove`
        watch --foxglove => this build | --features foxglove`"
    },
    if cfg!(feature = "lerobot") {
        "export lerobot none.run --out set => none.run | does not exist"
    } else {
        "export lerobot none.run --out set => this build | --features lerobot`"
    },
];

/// Commands that start processes or move an arm, and the configuration.
pub(crate) const MACHINES: &str = "
    => Usage
    fling => fling
    demo --seed x => --seed
    bench => NAME
    bench wibble => wibble | possible values | record
    demo --target 1,2 => x,y,z
    demo --target 3,0,0.4 => reach
    demo --target nan,0,0.4 => finite
    demo --out . => exists already
    demo --out rope.toml/run => rope.toml/run
    film --out w => --device
    film --device none --out w => camera none | there is no such device | /dev/v4l/by-id
    film --device /dev/null --out w => /dev/null | not a video device
    film --device /dev/null --out w --fps 0 => rate_hz is 0
    film --device /dev/null --out w --sensor-gain-raw 5 => --exposure-raw
    rig --report-ports 1,2 => four ports
    rig --bind here => --bind
    rig --bind 192.0.2.7 => 192.0.2.7
    rig --faults f.toml => f.toml
    rig --faults text.toml => text.toml | TOML
    rig --faults faults.toml => faults.toml | fault 1 | `joint` is 9 | from 1 to 7
    rig --camera x => --rope
    run => --arm | --controller
    run --arm 127.0.0.1:502 => port | --command-port
    run --arm localhost:502 => port | --command-port
    run --arm 127.0.0.1 => --camera | /dev/videoN
    run --arm 127.0.0.1 --camera /dev/video99 --target 0.9,0,0.3 => no camera | /dev/video99
    run --arm 127.0.0.1 --camera nobody => nobody | --calibration
    run --arm 127.0.0.1 --camera /dev/null --calibration bright.toml => [live] | 5000 | 2 to 880
    run --arm 127.0.0.1 --camera d --calibration no.toml => no.toml
    run --arm 127.0.0.1 --camera d --target 9,0,0 => out of reach
    run --from plann . --arm 127.0.0.1 --camera d => plann | identify, plan or throw
    run --from plan none --arm 127.0.0.1 --camera d => none
    run --from throw . --dry-run => plan.json
    run --from plan . --from throw . --arm 127.0.0.1 --camera d => name it once
    run --again . --seed 3 => cannot be used with
    run --from plan --arm 127.0.0.1 => --from
    run --again . --target 1,0,0 => cannot be used with
    run --tip-rgb 1,2 => R,G,B
    run --again . --dry-run => cannot be used with
    wiggle --csv w.csv --camera d => cannot be used with
    identify --keypoints . --out r.toml => camera.toml
    wiggle --calibration no.toml => --camera
    rope new => --out
    rope new --out rope.toml => rope.toml | exists already
    rope new --out no/r.toml => no/r.toml
    rope new --length 55 --out r.toml => length_m | 10
    rope new --length -1 --out r.toml => length_m
    run strike --dry-run --length 55 => --length | 0.05 to 5 m
    run strike --dry-run --robust -1 => --robust | invalid digit
    run strike --dry-run --arm-response no.toml => no.toml
    run strike --dry-run --camera lab --calibration no.toml => no.toml
    identify --keypoints run --length 55 => --length | 0.05 to 5 m
    rope new --lead-mass 60 --out r.toml => kg
    wiggle => --csv | --arm
    wiggle --csv no/w.csv => no/w.csv
    config check limits limits.toml => limits.toml | rate_hz
    config check limits slip.toml => slip.toml | line 1 | did you mean `tcp_speed_max_m_s`?
    config check limits mm.toml => mm.toml | `tcp_speed_max_m_s` is 900 | 2.2 | in mm/s?
    config show planner none.toml => none.toml | cannot read
    config show camera => camera | planner
    config => Usage
    throw damaged.json --arm 127.0.0.1 => damaged.json
    throw --arm 127.0.0.1 => PLAN | --again
    throw plan.json --again . => cannot be used with
    throw plan.json --miss 0,0,0 => --again
    throw --again none --arm 127.0.0.1 => none
    throw --again . --arm 127.0.0.1 => plan.json
    demo --again none => none | config/rig.toml
    demo --again . --seed 3 => cannot be used with
    latency => --arm | --run
    latency --run none => none | does not exist
    latency --run . => not a run folder | run.mcap
    latency --run . --arm 127.0.0.1 => cannot be used with
    latency --arm 127.0.0.1 --joints 8 => 8
    latency --arm 127.0.0.1 --response no/r.toml => no/r.toml | no such folder
    latency --arm 127.0.0.1 --excitation unknown.toml => unknown.toml
    latency --dry-run --excitation degrees.toml => degrees.toml | `pose_rad` is 90 | degrees
    process planner --config none.toml => none.toml
    process planner --config unknown.toml => unknown.toml
    demo --seed -1 => --seed | whole number from 0
    demo --target 0,0,0.2 => arm's base
    demo --rig-config none.toml => none.toml
    wiggle --dry-run --csv no/w.csv => no/w.csv | folder
    wiggle --dry-run --out . => exists already
    wiggle --arm no..host --dry-run => no..host";

/// Commands that read, list or watch runs.
pub(crate) const RECORDS: &str = "
    replay none.run => none.run | does not exist
    replay . => not a run folder | run.mcap
    replay empty.bin => empty.bin | is empty
    replay notvideo.avi => notvideo.avi | not a recording
    replay cut.bin => cut.bin | cut off | first chunk
    replay other.bin => other.bin | layout 9
    replay bare.mcap => bare.mcap | control cycles
    track --video bare.mcap --out k.json => bare.mcap | no motion
    identify --video bare.mcap --out r.toml => bare.mcap | no motion
    track --video bare.mcap --fps 60 --out k.json => bare.mcap | --fps
    track --video notvideo.avi --part 1 --out k.json => notvideo.avi | --part
    track --video notvideo.avi --pose pose.csv --out k.json => --camera
    track --video none --out k.json => none | cannot read
    track --video none.mcap --out k.json => none.mcap | cannot read
    track --video bare.mcap --film-late-ms 2000 => --film-late-ms | 1000
    identify --keypoints k.json --part 1 => --video
    record recover => FILE.mcap
    record recover none.mcap => none.mcap
    record recover . => `.`
    record recover notvideo.avi => notvideo.avi | not an MCAP file
    ledger none => none
    ledger . --csv none/a.csv => none/a.csv
    ledger --result great => great | broken
    ledger compare . => SECOND
    ledger compare none . => none | run folder
    ledger rerun . => `.` | not a run folder
    ledger rerun none => none | run folder
    export csv none.run => none.run | does not exist
    export csv empty.bin => empty.bin | is empty
    export npz none.run => none.run | does not exist
    export npz . => `.` | not a run folder
    explain none.run => none.run | does not exist
    explain . => not a run folder | run.mcap
    explain empty.bin => empty.bin | is empty
    explain notvideo.avi => notvideo.avi | not a recording
    explain cut.bin => cut.bin | cut off | first chunk
    explain other.bin => other.bin | layout 9
    replay . --from-cycle=x => --from-cycle
    record --out . => exists already
    record --seconds 0 => --seconds
    record --domain a.b => a.b | letters
    watch none => none | not a run folder
    watch --domain a.b => a.b | letters
    watch --bind here => --bind
    watch --bind 127.0.0.1:99999 => --bind
    watch --bind 192.0.2.7:0 => 192.0.2.7
    watch --seconds nan => --seconds
    record none => none | not a run folder";

/// Commands from files to files: films, ropes, plans.
pub(crate) const ROPES: &str = "
    calib => Usage | extrinsics
    sim rope --rope rope.toml --pose pose.csv --fps -60 --out o.npy => --fps
    sim rope --rope rope.toml --pose pose.csv --fps 60 --dt 0 --out o.npy => --dt
    sim rope --rope rope.toml --pose pose.csv --fps 60 --hanging --initial-joint0 0,0,0 --out o.npy => cannot be used with
    sim rope --rope rope.toml --pose pose.csv --fps 60 --out no/o.npy => no/o.npy
    sim throw --rope rope.toml --joints pose.csv --out o.csv => pose.csv | q1
    track --video v.avi --camera none.toml --pose pose.csv --out k.json => none.toml
    track --video v.avi --camera camera.toml --pose pose.csv --out k.json => camera.toml
    track --video v.avi --camera camera.toml --out k.json => --joints
    track --video v.avi --camera camera.toml --pose pose.csv --keypoints 1 --out k.json => --keypoints
    identify --keypoints k.json --video v.avi --camera camera.toml --pose pose.csv --out r.toml => cannot be used with
    identify --keypoints k.json --camera camera.toml --pose pose.csv --method nn --model missing.onnx --out r.toml => missing.onnx
    identify --keypoints k.json --camera camera.toml --pose pose.csv --method nn --model rope.toml --out r.toml => rope.toml | not an ONNX file
    identify --keypoints k.json --camera camera.toml --pose pose.csv --method cmaes --model m.onnx --out r.toml => m.onnx | --method nn
    identify --keypoints k.json --camera camera.toml --pose pose.csv --method nn --model LINKS --out r.toml => link | only simulated films show
    plan strike --rope rope.toml --target 2.5,0,0.3 --out p.json => reach | these bounds allow
    plan strike --rope unconfirmed.toml --accept-unconfirmed --target 2.5,0,0.3 --out p.json => warning: the track is unconfirmed | reach
    plan strike --rope rope.toml --target 0,0,0.1 --reach r.svg --out p.json => arm's base
    plan strike --rope rope.toml --target 1,0,0.3 --limits limits.toml --out p.json => limits.toml | rate_hz
    plan drape --rope rope.toml --target 1,0,0.3 --robust 8 --out p.json => rope.toml | posterior | --robust
    plan strike --rope rope.toml --target 1,0,0.3 --arm-response limits.toml --out p.json => arm response | limits.toml
    check none.json => none.json
    check none.json --fence -1,1,0.2 => --fence | 6 numbers
    check none.json --fence -1,1,0.2,-0.2,0,1 => boundary | in y
    check none.json --speed-factor 0 => --speed-factor
    check none.json --speed-factor 100 => --speed-factor | 1 m/s
    identify --keypoints k.json --lead-mass 50 --out r.toml => --lead-mass | kg
    check damaged.json => damaged.json
    score --video notvideo.avi --camera camera.toml --tip-rgb 1,2,300 --target-rgb 0,0,0 => 300
    score => --video | --run
    score --video notvideo.avi --camera camera.toml --tip-rgb 1,2,3 => --target-rgb
    score --video notvideo.avi --camera camera.toml --tip-rgb 1,2,3 --target-rgb 0,0,0 --run none => none | does not exist
    score --video notvideo.avi --camera camera.toml --tip-rgb 1,2,3 --target-rgb 0,0,0 --run . => not the folder of a throw | lacks plan.json
    identify --keypoints k.json --camera c.toml --pose p.csv --out r.toml --lead-mass -1 => --lead-mass | above 0
    identify --keypoints k.json --camera c.toml --pose p.csv --out r.toml --lead-mass 0 => --lead-mass | above 0
    identify --keypoints k.json --camera c.toml --pose p.csv --out r.toml --lead-mass heavy => --lead-mass | above 0
    identify --keypoints k.json --camera c.toml --pose p.csv --out r.toml --lead-mass nan => --lead-mass | above 0";

/// Ropes and poses of `wag sim rope`.
pub(crate) const SIM_ROPE: &str = "
    --rope none.toml --pose pose.csv => none.toml
    --rope negative.toml --pose pose.csv => negative.toml | lead_mass_kg | -0.05
    --rope zero.toml --pose pose.csv => zero.toml | links
    --rope missing.toml --pose pose.csv => missing.toml | length_m
    --rope unknown.toml --pose pose.csv => unknown.toml | line 10 | wibble
    --rope nan.toml --pose pose.csv => nan.toml | radius_m
    --rope text.toml --pose pose.csv => text.toml
    --rope rope.toml --pose nan.csv => nan.csv | line 12 | `x`
    --rope rope.toml --pose unsorted.csv => unsorted.csv | does not come after
    --rope rope.toml --pose columns.csv => columns.csv | t,x,y,z,qw,qx,qy,qz
    --rope rope.toml --pose noquat.csv => noquat.csv | quaternion
    --rope rope.toml --pose short.csv => short.csv | two rows";

/// What is asked for correctly and cannot be done: exit code 1.
pub(crate) const FAILED: &str = "
    plan strike --rope unconfirmed.toml --target 0.8,0,0.3 --out p.json => unconfirmed | end is not confirmed | --accept-unconfirmed
    throw unconfirmed.json --accept-unconfirmed --arm 127.0.0.1 --command-port 9 => warning: the track is unconfirmed | cannot connect | 127.0.0.1:9
    throw unconfirmed.json --arm 192.0.2.1 => unconfirmed | end is not confirmed | --accept-unconfirmed";
