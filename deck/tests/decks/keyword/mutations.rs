//! Whatever is done to a keyword deck, reading it ends with a model or with faults that have a place.

use deck::bundle::Options;

use super::{cube, folder, gathered};
use crate::damage::{Stream, is_read};

/// A deck with a few changes: words, columns, lines.
fn mutated(text: &str, stream: &mut Stream) -> String {
    const WORDS: [&str; 14] =
        ["-1", "0", "99999999999", "1e308", "1.5", "nan", "&x", "&(((", ",", "*", "$", "\u{e9}", "+", "1-"];
    let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
    for _ in 0..1 + stream.below(4) {
        // Mostly where the keywords are, not in the long lists.
        let n = if stream.below(4) == 0 { lines.len() } else { lines.len().min(90) };
        let (a, b) = (stream.below(n), stream.below(n));
        match stream.below(6) {
            0 => lines.swap(a, b),
            1 => {
                lines.remove(a);
            }
            2 => lines.insert(a, lines[b].clone()),
            3 => {
                let word = WORDS[stream.below(WORDS.len())];
                let cells: Vec<&str> = lines[a].split_inclusive([' ', ',']).collect();
                if !cells.is_empty() {
                    let at = stream.below(cells.len());
                    lines[a] =
                        cells.iter().enumerate().map(|(i, cell)| if i == at { word } else { cell }).collect();
                }
            }
            4 => {
                let at = stream.below(lines[a].chars().count() + 1);
                lines[a] = lines[a].chars().skip(at).collect();
            }
            _ => {
                let at = stream.below(lines[a].chars().count() + 1);
                let word = WORDS[stream.below(WORDS.len())];
                let mut chars: Vec<char> = lines[a].chars().collect();
                chars.splice(at..at, word.chars());
                lines[a] = chars.into_iter().collect();
            }
        }
        if lines.is_empty() {
            lines.push(String::new());
        }
    }
    lines.join("\n")
}

#[test]
fn mutated_keyword_decks_never_panic_and_faults_always_have_a_place() {
    let conditions = "*SET_NODE_LIST\n1\n1,2,3\n*SET_SEGMENT\n2\n5,6,7,8\n*DEFINE_CURVE\n3\n0,1\n1,2\n*LOAD_SEGMENT_SET\n2,3\n*LOAD_MOVING_PRESSURE\n1\n9,10,3,2,3\n2,0,4\n*NODE\n9,0,0,5\n10,0,0,4\n*LOAD_NODE_SET\n1,1,3\n*BOUNDARY_PRESCRIBED_MOTION_SET\n1,2,2,3\n*BOUNDARY_SPC_SET\n1,0,0,0,1\n*RIGIDWALL_PLANAR_MOVING\n1\n0,0,-1,0,0,2\n1e-3,0\n*HOURGLASS\n1,1,0.1\n*EOS_GRUNEISEN\n1,3e6,1.4\n*CONTROL_BULK_VISCOSITY\n1.4,0.05\n";
    let rigid = "*DEFINE_CURVE\n3\n0,1\n1,2\n*DEFORMABLE_TO_RIGID\n1,0,PART\n*CONSTRAINED_RIGID_BODIES\n1,1\n*INITIAL_VELOCITY_RIGID_BODY\n1,1.0,2.0,3.0,4.0\n*BOUNDARY_PRESCRIBED_MOTION_RIGID\n1,1,2,3,2.0\n1,6,0,3\n*CONTACT_FORCE_TRANSDUCER_PENALTY\n1,0,3\n";
    let (mut read, mut refused) = (0, 0);
    for text in
        [cube(conditions), cube(rigid), gathered(&folder("examples"), "bar-on-wall.k", &Options::default())]
    {
        for seed in 1..=800 {
            let deck = mutated(&text, &mut Stream(seed));
            *(if is_read(&deck, "a.k", seed) { &mut read } else { &mut refused }) += 1;
        }
    }
    assert!(read > 100 && refused > 100, "the changes test nothing: {read} read, {refused} refused");
}
