//! Drafts as JSON.
#![cfg(feature = "serde")]

use selvedge_wif::{Draft, parse};

#[test]
fn drafts_survive_json() {
    let file = "[WARP]\nThreads=4\nColor=1,9,9,9\nSymbol=X\nUnits=inches\n[WEFT]\nThreads=4\nSpacing=0.1\n\
                [WEFT SPACING]\n2=0.25\n[THREADING]\n1=1\n3=2,1\n[LIFTPLAN]\n4=0\n2=2\n[PRIVATE A]\nx\n";
    let draft = parse(file.as_bytes()).draft.unwrap();
    let json = serde_json::to_string(&draft).unwrap();
    assert!(json.contains(r#""threading":{"0":[0],"2":[1,0]}"#), "{json}");
    assert_eq!(serde_json::from_str::<Draft>(&json).unwrap(), draft);
}
