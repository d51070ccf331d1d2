//! `bolide picture`: what is drawn is where it must be, and what cannot be drawn is told.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use master::results::{
    self, Folder,
    history::History,
    vtu::{
        Series,
        read::{self, Piece},
    },
};
use mechanics::{
    initial,
    state::{GlobalState, field},
};

/// A block of 6 x 4 x 3 elements, at 0 to 60, 0 to 40, 0 to 30.
const DECK: &str = r#"
title = "A block"
units = "mm-ms-kg"
[control]
end_time = 1.0
[[part]]
name = "block"
material = "STEEL_4340"
box = { origin = [0, 0, 0], size = [60, 40, 30], cells = [6, 4, 3] }
"#;

fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("picture").join(name);
    if path.exists() {
        fs::remove_dir_all(&path).expect("an earlier run of this test made it");
    }
    path
}

/// Two states of the block: at rest, and with a pressure in one corner element, by index space.
fn block(name: &str, compress: bool, hot: [usize; 3]) -> (Folder, GlobalState) {
    let mut model = deck::read(DECK, "block.toml").expect("a sound deck");
    model.output.compress = compress;
    let (mesh, setup) = (&model.mesh, &model.setup);
    let mut state = initial::state(mesh, setup, &model.velocity, &model.constraint).expect("sound elements");
    let folder = Folder::create(&scratch(name), false).expect("fresh");
    // Units are told by the headings of the history.
    drop(History::create(&folder, &model).expect("fresh"));
    let mut series = Series::new(&folder, &model).expect("known fields");
    series.write(&model, &state, None).expect("written");
    state.time = 0.5;
    state.cycle = 7;
    let [i, j, k] = hot;
    state.elements[field::PRESSURE][i + 6 * (j + 4 * k)] = 2.5;
    series.write(&model, &state, None).expect("written");
    (folder, state)
}

fn picture(folder: &Path, flags: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bolide"));
    command.arg("picture").arg(folder).args(flags).output().expect("the binary was just built")
}

fn pixels(path: &Path) -> (usize, Vec<[u8; 3]>) {
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).expect("written")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut bytes).expect("a whole PNG");
    assert_eq!(info.color_type, png::ColorType::Rgb);
    let pixels = bytes[..info.buffer_size()].chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    (info.width as usize, pixels)
}

/// Mean place of the pixels left of the colour bar that fit, from the left and from the top, and how many.
fn centre(width: usize, pixels: &[[u8; 3]], fits: impl Fn([u8; 3]) -> bool) -> (f64, f64, f64) {
    let (mut x, mut y, mut n) = (0.0, 0.0, 0.0);
    for (i, &pixel) in pixels.iter().enumerate().filter(|(i, _)| i % width < width - 160) {
        if fits(pixel) {
            (x, y, n) = (x + (i % width) as f64, y + (i / width) as f64, n + 1.0);
        }
    }
    (x / f64::max(n, 1.0), y / f64::max(n, 1.0), n)
}

/// The yellow of the greatest value, in any light; nothing else is.
fn greatest([r, g, b]: [u8; 3]) -> bool {
    r > 110 && g > 100 && b < 80
}

/// The violet of the least value.
fn least([r, g, b]: [u8; 3]) -> bool {
    b > r && r > g && b > 35 && g < 40
}

#[test]
fn greatest_value_is_where_it_must_be_from_every_side() {
    let (folder, _) = block("sides", true, [5, 3, 2]);
    let out = folder.file("x.png");
    let draw = |view: &str| {
        let path = out.to_str().expect("UTF-8");
        let done = picture(folder.path(), &["--field", "pressure", "--out", path, "--view", view]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let text = String::from_utf8_lossy(&done.stdout).into_owned();
        assert!(text.contains("pressure (GPa) from 0 to 2.5, t = 0.5 ms, cycle 7, state 1 of 1"), "{text}");
        pixels(&out)
    };
    // The hot element has the greatest x, y and z: from the right, above; +1 is right or up on the picture.
    for (view, right, up) in [("z", 1.0, 1.0), ("x", 1.0, 1.0), ("y", -1.0, 1.0), ("-z", 1.0, -1.0)] {
        let (width, pixels) = draw(view);
        let (bx, by, violet) = centre(width, &pixels, least);
        let (hx, hy, yellow) = centre(width, &pixels, greatest);
        let shares = if matches!(view, "z") {
            24.0
        } else if view == "-z" {
            f64::INFINITY
        } else {
            18.0
        };
        if view == "-z" || view == "x" || view == "y" {
            // One face of the hot element is seen from x, y and z; from below none is.
            assert_eq!(yellow > 0.0, view != "-z", "{view}: {yellow} pixels");
        }
        assert!(violet > 20_000.0, "{view}: {violet} pixels, the picture is blank");
        if view == "-z" {
            continue;
        }
        assert!((hx - bx) * right > 20.0 && (by - hy) * up > 20.0, "{view}: {hx} {hy} beside {bx} {by}");
        let share = (violet + yellow) / yellow;
        let expected = if view == "x" { 12.0 } else { shares };
        assert!((0.8..1.3).contains(&(share / expected)), "{view}: one of {share} faces, not of {expected}");
    }
}

#[test]
fn inner_value_is_seen_in_a_cut_alone() {
    let (folder, _) = block("cut", false, [2, 2, 1]);
    let out = folder.file("x.png");
    for (cut, seen) in [(None, false), (Some("y"), true)] {
        let path = out.to_str().expect("UTF-8");
        let mut flags = vec!["--field", "pressure", "--out", path, "--view", "-y", "--range", "0,2.5"];
        flags.extend(cut.map(|axis| ["--cut", axis]).into_iter().flatten());
        assert!(picture(folder.path(), &flags).status.success());
        let (width, pixels) = pixels(&out);
        let (_, _, yellow) = centre(width, &pixels, greatest);
        assert_eq!(yellow > 1000.0, seen, "cut {cut:?}: {yellow} pixels");
    }
}

#[test]
fn what_cannot_be_drawn_is_told_by_name_and_exit_code() {
    let (folder, _) = block("faults", true, [0, 0, 0]);
    let out = folder.file("no.png");
    let path = out.to_str().expect("UTF-8");
    let said = |flags: &[&str], code: i32| {
        let done = picture(folder.path(), &[flags, &["--out", path]].concat());
        assert_eq!(done.status.code(), Some(code), "{flags:?}");
        assert!(!out.exists(), "{flags:?} wrote a picture");
        String::from_utf8_lossy(&done.stderr).into_owned()
    };
    let text = said(&["--field", "presure"], 1);
    for word in ["\"presure\"", "state-000001.vtu", "pressure", "plastic-strain", "velocity-z", "part"] {
        assert!(text.contains(word), "{word} is missing in {text}");
    }
    // Six numbers are no colour.
    assert!(said(&["--field", "stress"], 1).contains("no field \"stress\""));
    assert!(said(&["--state", "2"], 1).contains("no state 2 in"));
    assert!(said(&["--part", "1"], 1).contains("nothing to draw"));
    said(&["--view", "up"], 2);
    said(&["--range", "1,0"], 2);
    said(&["--width", "0"], 2);
    said(&["--state", "1", "--time", "0"], 2);
    let nowhere = picture(Path::new("/nowhere"), &["--out", path]);
    assert_eq!(nowhere.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&nowhere.stderr).contains("/nowhere/results.pvd"));
    // A state that was cut short.
    let state = folder.file(&results::state_name(1));
    let whole = fs::read(&state).expect("written");
    for end in [0, 100, 2000, whole.len() / 2, whole.len() - 200] {
        fs::write(&state, &whole[..end]).expect("writable");
        assert!(said(&["--field", "pressure"], 1).contains("state-000001.vtu"), "{end} bytes");
    }
}

#[test]
fn states_read_back_to_the_same_bits_compressed_or_not_and_compressed_are_smaller() {
    let mut sizes = Vec::new();
    for compress in [false, true] {
        let (folder, state) = block(if compress { "packed" } else { "raw" }, compress, [1, 2, 0]);
        let listed = read::index(folder.path()).expect("whole");
        assert_eq!(listed.iter().map(|(time, _)| *time).collect::<Vec<_>>(), [0.0, 0.5]);
        let piece = Piece::open(&listed[1].1).expect("whole");
        assert_eq!((piece.time, piece.cycle, piece.n_points, piece.n_cells), (0.5, 7, 140, 72));
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let points: Vec<f64> = piece.points().expect("whole").into_iter().flatten().collect();
        assert_eq!(bits(&points), bits(&state.x.concat()));
        let pressure = piece.numbers(piece.expect("CellData", "pressure").expect("a default field"), 72);
        assert_eq!(bits(&pressure.expect("whole")), bits(&state.elements[field::PRESSURE]));
        let cells = piece.cells("Cells").expect("whole");
        assert_eq!((cells.len(), cells[0].as_slice()), (72, [0, 1, 8, 7, 35, 36, 43, 42].as_slice()));
        sizes.push(fs::metadata(&listed[1].1).expect("written").len());
        // The same numbers are the same bytes.
        let again = block(if compress { "packed again" } else { "raw again" }, compress, [1, 2, 0]).0;
        assert_eq!(
            fs::read(&listed[1].1).expect("written"),
            fs::read(again.file(&results::state_name(1))).expect("written")
        );
    }
    assert!(2 * sizes[1] < sizes[0], "{sizes:?} bytes");
}

#[test]
fn a_movie_has_a_picture_for_every_state_under_one_range_of_colours() {
    let (folder, _) = block("movie", true, [5, 3, 2]);
    let small = ["--field", "pressure", "--width", "320", "--height", "240", "--movie"];
    let make = |name: &str| {
        let path = folder.file(name);
        let mut flags = small.to_vec();
        let text = path.display().to_string();
        flags.push(&text);
        let done = picture(folder.path(), &flags);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let told = String::from_utf8_lossy(&done.stdout).into_owned();
        assert!(told.contains("2 states, pressure (GPa) from 0 to 2.5"), "{told}");
        path
    };
    let file = |path: &Path| std::io::BufReader::new(fs::File::open(path).expect("written"));
    let apng = make("all.apng");
    let reader = png::Decoder::new(file(&apng)).read_info().expect("a PNG");
    assert_eq!(reader.info().animation_control().expect("an animation").num_frames, 2);
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(file(&make("all.gif"))).expect("a GIF");
    assert_eq!((reader.width(), reader.height()), (320, 240));
    let mut yellow = Vec::new();
    while let Some(frame) = reader.read_next_frame().expect("a whole GIF") {
        // Left of the colour bar.
        let bright = |(i, p): (usize, &[u8])| i % 320 < 200 && greatest([p[0], p[1], p[2]]);
        yellow.push(frame.buffer.chunks(4).enumerate().filter(|(i, p)| bright((*i, p))).count());
    }
    // At rest nothing has the greatest pressure of all states.
    assert!(yellow.len() == 2 && yellow[0] == 0 && yellow[1] > 20, "{yellow:?}");
    let refused = picture(folder.path(), &["--movie", "all.mp4"]);
    let why = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && why.contains("name a .gif or .apng"), "{why}");
    assert!(why.contains("ffmpeg -i all.apng -pix_fmt yuv420p all.mp4"), "{why}");
}

#[test]
fn a_deck_is_drawn_before_it_runs_mirrored_and_by_parts() {
    let folder = scratch("deck");
    fs::create_dir_all(&folder).expect("room");
    let deck = folder.join("quarter.toml");
    let text = DECK
        .replace("[[part]]", "[symmetry]\nplanes = [\"x\"]\n[[part]]")
        .replace("[0, 0, 0], size", "[-30, 0, 0], size")
        + "[[part]]\nname = \"other\"\nmaterial = \"STEEL_4340\"\nbox = { origin = [0, 0, 40], size = [30, 40, 30], cells = [3, 4, 3] }\n";
    fs::write(&deck, text).expect("room");
    let out = folder.join("x.png");
    let draw = |flags: &[&str]| {
        let path = out.display().to_string();
        let done = picture(&deck, &[&["--view", "-y", "--out", &path], flags].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let told = String::from_utf8_lossy(&done.stdout).into_owned();
        assert!(told.contains("part from 0 to 1, as a run begins") || !flags.is_empty(), "{told}");
        let (width, pixels) = pixels(&out);
        centre(width, &pixels, |pixel| greatest(pixel) || least(pixel))
    };
    let (_, _, half) = draw(&[]);
    let (_, _, whole) = draw(&["--mirror"]);
    // Twice as wide and as high: both are 60 wide and 70 high, and fill the height.
    assert!(whole > 1.8 * half && whole < 2.2 * half, "{half} and {whole}");
    let (_, _, one) = draw(&["--part", "block", "--range", "0,1"]);
    assert!(one > 0.0);
    let refused = picture(&deck, &["--part", "nothing"]);
    let why = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && why.contains("no such part; there are block, other"), "{why}");
    let refused = picture(&deck, &["--state", "3"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("is a deck, which has no states"));
}
