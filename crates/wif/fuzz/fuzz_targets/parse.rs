//! Any bytes are read without panic; what was read is written and read again as the same draft.
#![no_main]

use libfuzzer_sys::fuzz_target;
use selvedge_wif::parse;

fuzz_target!(|bytes: &[u8]| {
    let first = parse(bytes);
    assert_eq!(first.document.as_bytes(), bytes);
    for diagnostic in &first.diagnostics {
        assert!(!diagnostic.display(bytes).to_string().is_empty());
    }
    if let Some(draft) = first.draft {
        let text = draft.to_wif();
        assert_eq!(parse(text.as_bytes()).draft.as_ref(), Some(&draft), "by way of\n{text}");
        if u64::from(draft.warp.count) * u64::from(draft.weft.count) < 1 << 20 {
            if let Ok(drawdown) = draft.drawdown() {
                assert_eq!(draft.to_liftplan().drawdown().as_ref(), Ok(&drawdown));
                let _ = (drawdown.weave(), drawdown.back());
            }
        }
    }
});
