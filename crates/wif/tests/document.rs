//! The file as written, and edits that change one line.

use selvedge_wif::{Content, Document, EditError, Encoding, parse};

const FILE: &str = "; made by hand\nVersion = 1.1\n[ Warp ]\r\n; narrow\r\nThreads = 8 ; for now\r\n\r\n\
                    [WARP COLORS]\r1=1\r[private X]\nfree text\n[TEXT]\nTitle= a; b \n[warp]\nColor=2";

fn edited(section: &str, key: &str, value: &str) -> String {
    let mut document = Document::new(FILE);
    document.set(section, key, value).expect("the edit is fine");
    String::from_utf8(document.into_bytes()).expect("the file is UTF-8")
}

#[test]
fn sections_and_lines_are_as_written() {
    let document = Document::new(FILE);
    let names: Vec<_> = document.sections().map(|section| section.name()).collect();
    let names: Vec<_> = names.iter().map(Option::as_deref).collect();
    let expected =
        [None, Some("Warp"), Some("WARP COLORS"), Some("private X"), Some("TEXT"), Some("warp")];
    assert_eq!(names, expected);
    let warp = document.sections().nth(1).unwrap();
    let lines: Vec<_> = warp.lines().map(|line| line.content).collect();
    let threads = Content::Entry { key: "Threads".into(), value: "8 ; for now".into() };
    assert_eq!(lines, [Content::Comment("; narrow".into()), threads, Content::Blank]);
    let text = warp.lines().nth(1).unwrap().span.of(FILE.as_bytes());
    assert_eq!(text, b"Threads = 8 ; for now");
}

#[test]
fn values_are_found_by_name() {
    let document = Document::new(FILE);
    let get = |section, key| document.get(section, key).map(std::borrow::Cow::into_owned);
    assert_eq!(get("WARP", "threads").as_deref(), Some("8"));
    assert_eq!(get("warp", "COLOR").as_deref(), Some("2"));
    assert_eq!(get("Text", "title").as_deref(), Some("a; b"));
    assert_eq!(get("wif", "version").as_deref(), Some("1.1"));
    assert_eq!(get("WEFT", "Threads"), None);
    assert_eq!(get("WARP", "Units"), None);
}

#[test]
fn a_value_is_replaced_in_place() {
    assert_eq!(edited("WARP", "THREADS", "12"), FILE.replace("= 8 ;", "= 12 ;"));
    assert_eq!(edited("text", "Title", "x"), FILE.replace("= a; b \n", "= x \n"));
    assert_eq!(edited("WARP", "Color", ""), FILE.replace("Color=2", "Color="));
}

#[test]
fn a_new_key_goes_to_the_end_of_its_section() {
    assert_eq!(edited("TEXT", "Author", "me"), FILE.replace("a; b \n", "a; b \nAuthor=me\n"));
    assert_eq!(edited("WARP", "Units", "inches"), format!("{FILE}\nUnits=inches\n"));
    assert_eq!(edited("WARP COLORS", "2", "3"), FILE.replace("1=1\r", "1=1\r2=3\n"));
}

#[test]
fn a_new_section_goes_to_the_end_of_the_file() {
    assert_eq!(edited("WEFT", "Threads", "3"), format!("{FILE}\n\n[WEFT]\nThreads=3\n"));
    let mut empty = Document::new("");
    empty.set("WEFT", "Threads", "3").unwrap();
    assert_eq!(empty.as_bytes(), b"[WEFT]\nThreads=3\n");
    let mut dos = Document::new("[WARP]\r\n");
    dos.set("WEFT", "Threads", "3").unwrap();
    assert_eq!(dos.as_bytes(), b"[WARP]\r\n\r\n[WEFT]\r\nThreads=3\r\n");
}

#[test]
fn a_line_is_removed_whole() {
    let mut document = Document::new(FILE);
    assert!(document.remove("WARP", "threads"));
    assert!(!document.remove("WARP", "threads"));
    assert_eq!(document.as_bytes(), FILE.replace("Threads = 8 ; for now\r\n", "").as_bytes());
}

#[test]
fn what_would_not_be_read_back_is_refused() {
    let mut document = Document::new(b"[TEXT]\nTitle=K\xf6per\n".as_slice());
    assert_eq!(document.encoding(), Encoding::Windows1252);
    let cases = [
        ("TEXT", "Title", "→", EditError::Unencodable { character: '→' }),
        ("TEXT", "Title", "a\nb", EditError::Value),
        ("TEXT", "", "a", EditError::Key),
        ("TEXT", " ;x", "a", EditError::Key),
        ("TEXT", "a=b", "a", EditError::Key),
        ("TE]XT", "Title", "a", EditError::SectionName),
        (" ", "Title", "a", EditError::SectionName),
    ];
    for (section, key, value, error) in cases {
        assert_eq!(document.set(section, key, value), Err(error), "{section} {key} {value}");
    }
    document.set("TEXT", "Author", "Grün").unwrap();
    assert_eq!(document.as_bytes(), b"[TEXT]\nTitle=K\xf6per\nAuthor=Gr\xfcn\n");
}

#[test]
fn an_edit_reaches_the_draft() {
    let file = "[WARP]\nThreads=4\n[WEFT]\nThreads=4\n[THREADING]\n1=1\n[LIFTPLAN]\n1=1\n";
    let mut document = parse(file.as_bytes()).document;
    document.set("WARP", "Threads", "6").unwrap();
    assert_eq!(parse(document.as_bytes()).draft.unwrap().warp.count, 6);
}

#[test]
fn comments_are_those_that_are_not_content() {
    let file = "; head\r\n[TEXT]\r\nTitle=a; b\r\n[WARP]\r\nThreads=4 ; narrow\r\n  ;x\r\n\
                [PRIVATE P]\r\n; kept\r\na=1 ; kept\r\n[NOTES]\r\n;lost\r\n1=a;b\r\n";
    let document = Document::new(file);
    let comments = document.comments().map(|span| span.of(file.as_bytes()));
    let expected: [&[u8]; 4] = [b"; head", b"; narrow", b";x", b";lost"];
    assert_eq!(comments.collect::<Vec<_>>(), expected);
}
