//! `selvedge studio` as a program that others talk to: what it answers, to whom, and that it draws what
//! `selvedge render` and `selvedge swatch` draw.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    io::{BufRead, BufReader, ErrorKind, Read, Write},
    net::{SocketAddr, TcpStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use clap::Parser;
use selvedge_cli::{Outcome, args::Arguments};
use serde_json::{Value, json};

/// A studio that runs, until this goes.
struct Studio {
    child: Child,
    address: SocketAddr,
    token: String,
}

struct Answer {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| {
            panic!("{error}: {}", String::from_utf8_lossy(&self.body));
        })
    }
}

impl Studio {
    fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_selvedge"))
            .args(["studio", "--no-open", "--threads", "2"])
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut url).unwrap();
        let (address, token) = url.trim().split_once("/?token=").unwrap();
        let address = address.strip_prefix("http://").unwrap().parse().unwrap();
        Self { child, address, token: token.to_owned() }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(120))).unwrap();
        stream
    }

    /// The answer to exactly these bytes.
    fn raw(&self, request: &[u8]) -> Answer {
        let mut stream = self.connect();
        // It may answer and close before it has read all.
        let _ = stream.write_all(request);
        let mut bytes = Vec::new();
        match stream.read_to_end(&mut bytes) {
            Err(error) if error.kind() != ErrorKind::ConnectionReset => panic!("{error}"),
            _ => {}
        }
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n");
        let (head, body) = bytes.split_at(end.map_or(bytes.len(), |end| end + 4));
        let head = String::from_utf8_lossy(head).into_owned();
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
        Answer { status, body: body.to_vec(), head }
    }

    fn request(&self, method: &str, target: &str, headers: &str, body: &[u8]) -> Answer {
        let (address, length) = (self.address, body.len());
        let host =
            if headers.contains("Host:") { String::new() } else { format!("Host: {address}\r\n") };
        let head = format!(
            "{method} {target} HTTP/1.1\r\n{host}Connection: close\r\nContent-Length: {length}\r\n{headers}\r\n"
        );
        self.raw(&[head.as_bytes(), body].concat())
    }

    fn get(&self, path: &str) -> Answer {
        self.request("GET", &format!("/{}/{path}", self.token), "", b"")
    }

    fn post(&self, path: &str, body: &[u8]) -> Answer {
        self.request("POST", &format!("/{}/{path}", self.token), "", body)
    }

    /// The document that it starts with: the fabric, with its draft, and the view.
    fn document(&self) -> Value {
        self.get("api/document").json()
    }

    /// Bytes of memory that it holds.
    fn memory(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
        1024 * line.trim().strip_suffix(" kB").unwrap().parse::<u64>().unwrap()
    }

    /// Events until `is_last` says so.
    fn events(&self, is_last: impl Fn(&str, &Value) -> bool) -> Vec<(String, Value)> {
        let mut stream = self.connect();
        let (token, address) = (&self.token, self.address);
        write!(stream, "GET /{token}/api/events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
        let (mut events, mut name) = (Vec::new(), String::new());
        for line in BufReader::new(stream).lines() {
            let line = line.unwrap();
            if let Some(found) = line.strip_prefix("event: ") {
                found.clone_into(&mut name);
            } else if let Some(data) = line.strip_prefix("data: ") {
                let data: Value = serde_json::from_str(data).unwrap();
                let ends = is_last(&name, &data);
                events.push((name.clone(), data));
                if ends {
                    break;
                }
            }
        }
        events
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(name)
}

/// Runs the command line that the studio names, with its files in `folder`.
fn run(command: &str, folder: &Path, output: &str) -> Vec<u8> {
    let at = |name: &str| folder.join(name).display().to_string();
    let words = command.split(' ').map(|word| match word {
        "fabric.json" => at("fabric.json"),
        "out.png" => at(output),
        word => word.to_owned(),
    });
    let words = words.chain(["--quiet".to_owned(), "--threads".to_owned(), "1".to_owned()]);
    assert_eq!(
        selvedge_cli::run(&Arguments::parse_from(words)).unwrap(),
        Outcome::Done,
        "{command}"
    );
    fs::read(folder.join(output)).unwrap()
}

#[test]
fn what_it_shows_is_what_the_command_line_draws_from_the_saved_fabric() {
    let studio = Studio::start(&["preset:denim"]);
    let mut fabric = studio.document()["fabric"].clone();
    fabric["yarn"]["psi"] = json!(0.37);
    fabric["overrides"][0]["yarn"]["color"] = json!([0.1, 0.3, 0.02]);
    let folder = tempfile::tempdir().unwrap();
    let saved = studio.post("api/fabric-text", json!({ "fabric": fabric }).to_string().as_bytes());
    let text = saved.json()["text"].as_str().unwrap().to_owned();
    fs::write(folder.path().join("fabric.json"), text).unwrap();
    let views = [
        json!({ "kind": "swatch", "size": [40, 28], "spp": 5, "noise": null, "mm": 3.3, "at": [3.7, -1.25] }),
        json!({
            "kind": "swatch", "size": [48, 32], "spp": 64, "noise": 0.3, "back": true, "seed": 7,
            "light": { "azimuth": -33.3, "elevation": 41.7 }, "exposure": -0.7, "lod": "near"
        }),
        json!({
            "kind": "sphere", "size": [32, 48], "spp": 3, "noise": null,
            "camera": { "azimuth": 12.1, "elevation": 28.9, "distance": 0.83 }
        }),
        json!({
            "kind": "drape", "size": [48, 32], "spp": 2, "noise": null,
            "camera": { "azimuth": -100.1, "elevation": 61.3, "distance": 0.37 },
            "light": { "azimuth": 77.7, "elevation": 12.3 }
        }),
    ];
    for view in views {
        let document = json!({ "fabric": fabric, "view": view });
        let answer = studio.post("api/document", document.to_string().as_bytes());
        assert_eq!(answer.status, 200, "{}", answer.json());
        let command = studio.get("api/command").json()["command"].as_str().unwrap().to_owned();
        let shown = studio.get("api/export?format=png");
        assert_eq!(shown.status, 200, "{command}");
        assert!(shown.body == run(&command, folder.path(), "out.png"), "{command}");
        if view["kind"] == "drape" {
            // It falls anew each time the command line draws it, which takes a while.
            continue;
        }
        let layers = studio.get("api/export?format=exr");
        assert_eq!(layers.status, 200, "{command}");
        assert!(layers.body == run(&command, folder.path(), "out.exr"), "{command}, as EXR");
    }
    // What is on the screen is that picture too.
    let revision = studio.document()["revision"].clone();
    let is_done = |name: &str, data: &Value| name == "frame" && data["done"] == true;
    let events = studio.events(is_done);
    let (_, frame) = events.last().unwrap();
    assert_eq!((&frame["revision"], &frame["stopped"]), (&revision, &json!("spp")));
    let shown = studio.get(&format!("api/frame/{}.png", frame["id"]));
    assert!(shown.body == studio.get("api/export?format=png").body);
}

#[test]
fn nobody_is_let_in_without_the_token_or_by_another_name() {
    let studio = Studio::start(&["preset:tartan-wool"]);
    let (token, address) = (&studio.token, studio.address);
    let paths = [
        "",
        "studio.css",
        "main.js",
        "nothing",
        "api/document",
        "api/events",
        "api/parameters",
        "api/cloth",
        "api/draft",
        "api/albedo?yarn=0",
        "api/at?x=1&y=1",
        "api/mask?end=1",
        "api/wif",
        "api/presets",
        "api/preset/denim",
        "api/preset/denim.png",
        "api/frame/1.png",
        "api/export?format=png",
        "api/command",
        "api/save",
        "api/fabric-text",
        "../etc/passwd",
    ];
    let wrong = token.chars().rev().collect::<String>();
    for path in paths {
        for method in ["GET", "POST", "PUT", "DELETE", "OPTIONS", "HEAD", "TRACE", "BREW"] {
            let answer = studio.request(method, &format!("/{path}"), "", b"{}");
            assert_eq!(answer.status, 403, "{method} {path}");
        }
        let mark = if path.contains('?') { '&' } else { '?' };
        for target in [
            format!("/{wrong}/{path}"),
            format!("/{}/{path}", &token[..31]),
            format!("/{path}{mark}token={wrong}"),
            format!("/{path}{mark}token="),
            format!("/{path}{mark}nottoken={token}"),
        ] {
            assert_eq!(studio.request("GET", &target, "", b"").status, 403, "{target}");
        }
        let good = format!("/{token}/{path}");
        for headers in [
            "Host: evil.example\r\n".to_owned(),
            format!("Host: evil.example:{}\r\n", address.port()),
            "Host: 127.0.0.1\r\n".to_owned(),
            format!("Host: {address}\r\nHost: {address}\r\n"),
            "Origin: http://evil.example\r\n".to_owned(),
            "Origin: null\r\n".to_owned(),
            format!("Origin: https://{address}\r\n"),
        ] {
            let answer = studio.request("GET", &good, &headers, b"");
            assert_eq!(answer.status, 403, "{path} {headers}");
        }
        let absolute = format!("http://evil.example/{token}/{path}");
        assert_eq!(studio.request("GET", &absolute, "", b"").status, 403, "{absolute}");
    }
    for (target, headers) in [
        (format!("/?token={token}"), String::new()),
        (format!("/{token}/"), format!("Origin: http://{address}\r\n")),
        ("/".to_owned(), format!("X-Selvedge-Token: {token}\r\n")),
        (format!("/{token}/"), format!("Host: localhost:{}\r\n", address.port())),
    ] {
        let answer = studio.request("GET", &target, &headers, b"");
        assert_eq!(answer.status, 200, "{target} {headers}");
        let text = String::from_utf8(answer.body).unwrap();
        assert!(text.contains(&format!("<base href=\"/{token}/\">")), "{text}");
        assert!(
            answer.head.contains("content-security-policy: default-src 'none'"),
            "{}",
            answer.head
        );
    }
    for name in ["studio.css", "main.js"] {
        assert_eq!(studio.get(name).status, 200, "{name}");
    }
    assert_eq!(studio.request("PUT", &format!("/{token}/api/document"), "", b"").status, 405);
}

#[test]
fn no_path_from_a_client_is_opened_and_what_is_wrong_is_told() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plain.wif"), fs::read(fixture("drafts/tartan.wif")).unwrap())
        .unwrap();
    let start = r#"{"version": 1, "draft": "plain.wif", "yarn": {"psi": 0.1}}"#;
    let path = folder.path().join("start.json");
    fs::write(&path, start).unwrap();
    let studio = Studio::start(&[path.to_str().unwrap()]);
    for path in [
        "../Cargo.toml",
        "..%2fCargo.toml",
        "/etc/passwd",
        "%2e%2e/%2e%2e/etc/passwd",
        "page/main.js",
        "api/preset/../../start.json",
        "api/preset/..%2fstart",
        "api/preset/start.json",
        "api/frame/../1.png",
        "api/frame/18446744073709551616.png",
        "api/frame/-1.png",
        "main.js/",
        "./main.js",
        "api",
        "api/",
    ] {
        let answer = studio.get(path);
        assert!(matches!(answer.status, 404), "{path}: {}", answer.status);
    }
    let named = path.to_str().unwrap();
    for (body, expected) in [
        (
            json!({"fabric": {"version": 1, "draft": "plain.wif"}}),
            format!("{named}: draft: found a path, expected {{\"wif\": \"its text\"}}"),
        ),
        (
            json!({"fabric": {"version": 1, "draft": "/etc/passwd"}}),
            format!("{named}: draft: found a path, expected {{\"wif\": \"its text\"}}"),
        ),
        (
            json!({"fabric": {"version": 1, "yarn": {"color": {"image": "/etc/passwd", "mm": [1, 1]}}}}),
            format!("{named}: yarn.color.image: found a path, expected a data: URI"),
        ),
        (
            json!({"fabric": {"version": 1, "overrides": [{"yarn": {"psi": {
                "image": "data:;base64,AAAA", "mm": [1, 1], "range": [0, 1]
            }}}]}}),
            format!(
                "{named}: overrides[0].yarn.psi.image: found a file that begins with 00 00 00, expected a PNG"
            ),
        ),
        (
            json!({"fabric": {"version": 1, "textures": ["/etc/passwd"]}}),
            format!("{named}: unknown key \"textures\", expected one of"),
        ),
        (
            json!({"fabric": {"version": 1, "yarn": {"kappa": -1}}}),
            format!("{named}: yarn: kappa: -1, expected -0.999 to 1000"),
        ),
        (json!({"fabric": {"version": 2}}), format!("{named}: found version 2, expected 1")),
        (
            json!({"fabric": {"version": 1}, "view": {"mm": -1}}),
            "view.mm: found -1, expected 0.1 to 1000".to_owned(),
        ),
        (json!({"fabric": {"version": 1}, "path": "x"}), "line 1, column".to_owned()),
        (json!([]), "line 1, column".to_owned()),
    ] {
        for address in ["api/document", "api/save", "api/fabric-text"] {
            let answer = studio.post(address, body.to_string().as_bytes());
            let errors = answer.json()["errors"].clone();
            assert_eq!(answer.status, 422, "{address} {body}: {errors}");
            assert!(
                errors[0].as_str().unwrap().starts_with(&expected),
                "{errors}, expected {expected}"
            );
        }
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), start);
    assert_eq!(studio.document()["revision"], 1, "nothing was shown of all that");

    // It saves where it was started from, and the draft stays where it is.
    assert_eq!(studio.document()["saves_to"], named);
    let saved = studio.post("api/save", br#"{"fabric": {"version": 1, "yarn": {"psi": 0.2}}}"#);
    assert_eq!(saved.json(), json!({ "saved": named }));
    let text: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    assert_eq!((&text["draft"], &text["yarn"]), (&json!("plain.wif"), &json!({ "psi": 0.2 })));
    let preset = Studio::start(&["preset:denim"]);
    assert_eq!(preset.post("api/save", br#"{"fabric": {"version": 1}}"#).status, 409);
}

#[test]
fn drafts_are_read_and_described() {
    let studio = Studio::start(&["preset:denim"]);
    let broken = studio.post("api/wif?name=a%20b.wif", b"[WIF]\nVersion=1.1\n[WARP]\nThreads=x\n");
    assert_eq!(broken.status, 422);
    let broken = broken.json();
    assert!(!broken["errors"].as_array().unwrap().is_empty(), "{broken}");
    let found = broken["diagnostics"].as_array().unwrap();
    assert!(found.iter().any(|one| one["severity"] == "error" && one["line"] == 3), "{broken}");
    assert!(found[0]["text"].as_str().unwrap().contains("a b.wif"), "{broken}");

    let wif = fs::read(fixture("drafts/tartan.wif")).unwrap();
    let good = studio.post("api/wif?name=tartan.wif", &wif).json();
    let posted = json!({ "fabric": good["fabric"], "view": { "kind": "swatch", "size": [64, 48], "spp": 1, "noise": null } });
    let shown = studio.post("api/document", posted.to_string().as_bytes()).json();
    assert_eq!(
        (&shown["ends"], &shown["picks"], &shown["revision"]),
        (&json!(144), &json!(144), &json!(2))
    );
    let draft = studio.get("api/draft").json();
    assert_eq!(draft["drawdown"].as_array().unwrap().len(), 144);
    let cloth = studio.get("api/cloth").json();
    let yarns = cloth["yarns"].as_array().unwrap();
    let threads: u64 = yarns
        .iter()
        .map(|yarn| yarn["ends"].as_u64().unwrap() + yarn["picks"].as_u64().unwrap())
        .sum();
    assert_eq!(threads, 288);

    let events = studio
        .events(|name, data| name == "frame" && data["done"] == true && data["revision"] == 2);
    assert!(
        events.iter().any(|(name, data)| name == "prepared" && data["revision"] == 2),
        "{events:?}"
    );
    let at = studio.get("api/at?x=32.5&y=20.5").json();
    let (end, pick) = (at["end"].as_u64().unwrap(), at["pick"].as_u64().unwrap());
    assert!((1..=144).contains(&end) && (1..=144).contains(&pick), "{at}");
    let row = draft["drawdown"][pick as usize - 1].as_str().unwrap().as_bytes();
    assert_eq!(at["warp_on_top"], row[end as usize - 1] == b'1', "{at}");
    let yarn = &yarns[at["yarn"].as_u64().unwrap() as usize];
    assert_eq!(at["values"], yarn["values"]);
    let mask = studio.get(&format!("api/mask?end={end}&pick={pick}"));
    let mask = selvedge_cli::image::decode(&mask.body).unwrap();
    let alpha = &mask.layer("").unwrap().channels[3];
    assert_eq!(
        alpha.samples.get(20 * 64 + 32),
        1.0,
        "the crossing asked for is where it was found"
    );
    assert!((0..64 * 48).any(|pixel| alpha.samples.get(pixel) == 0.0), "and not everywhere");
    let albedo = studio.get("api/albedo?yarn=0").json();
    let total: Vec<f64> =
        albedo["total"].as_array().unwrap().iter().map(|a| a.as_f64().unwrap()).collect();
    assert!(total.iter().all(|share| (0.0..=1.0).contains(share)) && total[0] > 0.0, "{total:?}");
    assert_eq!(studio.get("api/albedo?yarn=99").status, 404);
}

/// Numbers that look random (Steele, Lea & Flood 2014, SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % limit as u64) as usize
    }

    fn value(&mut self, depth: usize) -> Value {
        const WORDS: [&str; 12] = [
            "psi",
            "yarn",
            "draft",
            "wif",
            "overrides",
            "threads",
            "size",
            "kind",
            "rough",
            "",
            "\u{0}",
            "é",
        ];
        match self.below(if depth == 0 { 6 } else { 8 }) {
            0 => Value::Null,
            1 => (self.below(2) == 0).into(),
            2 => [0.0, -1.0, 1e308, 5e-324, 0.5, 1e9][self.below(6)].into(),
            3 => (self.below(5) as u64).into(),
            4 => u64::MAX.into(),
            5 => WORDS[self.below(WORDS.len())].into(),
            6 => (0..self.below(4)).map(|_| self.value(depth - 1)).collect(),
            _ => {
                let count = self.below(4);
                let entry = |random: &mut Self| {
                    (WORDS[random.below(WORDS.len())].to_owned(), random.value(depth - 1))
                };
                (0..count).map(|_| entry(self)).collect::<serde_json::Map<_, _>>().into()
            }
        }
    }

    /// Puts something else in some place of `value`.
    fn disturb(&mut self, value: &mut Value) {
        let parts: Vec<&mut Value> = match value {
            Value::Array(list) => list.iter_mut().collect(),
            Value::Object(map) => map.values_mut().collect(),
            _ => Vec::new(),
        };
        let count = parts.len();
        if count == 0 || self.below(4) == 0 {
            *value = self.value(3);
        } else if let Some(part) = parts.into_iter().nth(self.below(count)) {
            self.disturb(part);
        }
    }
}

/// Most bytes of memory by which clients who mean ill make it grow.
const GROWTH: u64 = 96 << 20;

#[test]
fn clients_who_mean_ill_neither_end_it_nor_make_it_grow() {
    let studio = Studio::start(&["preset:cotton-twill"]);
    let document = studio.document();
    let view = json!({ "kind": "swatch", "size": [64, 48], "spp": 1, "noise": null });
    let good = json!({ "fabric": document["fabric"], "view": view });
    assert_eq!(studio.post("api/document", good.to_string().as_bytes()).status, 200);
    studio.events(|name, data| name == "frame" && data["done"] == true);
    let before = studio.memory();

    // Documents with something else somewhere, and what is no document at all.
    let mut random = Random(1);
    for round in 0..200 {
        let mut body = good.clone();
        random.disturb(&mut body);
        let mut bytes = body.to_string().into_bytes();
        for _ in 0..random.below(2) * random.below(8) {
            let place = random.below(bytes.len());
            bytes[place] = random.below(256) as u8;
        }
        let address = ["document", "save", "fabric-text", "wif"][random.below(4)];
        let answer = studio.post(&format!("api/{address}"), &bytes);
        assert!(matches!(answer.status, 200 | 409 | 422), "round {round}: {}", answer.status);
    }
    for query in [
        "",
        "?x=1",
        "?x=NaN&y=inf",
        "?x=1e38&y=-1e38",
        "?yarn=65536",
        "?end=0",
        "?pick=4294967295",
        "?=&=&",
    ] {
        for address in ["at", "mask", "albedo", "export", "draft"] {
            let answer = studio.get(&format!("api/{address}{query}"));
            assert!(
                matches!(answer.status, 200 | 404 | 409 | 422),
                "{address}{query}: {}",
                answer.status
            );
        }
    }

    // Bodies that are too large, claimed or not, and deeper than a stack.
    let (token, address) = (&studio.token, studio.address);
    let head =
        format!("POST /{token}/api/wif HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n");
    let claimed = studio.raw(format!("{head}Content-Length: 99999999999\r\n\r\n").as_bytes());
    assert_eq!(claimed.status, 413);
    let chunk = [b"100000\r\n".as_slice(), &vec![b'['; 1 << 20], b"\r\n"].concat();
    let mut endless = format!("{head}Transfer-Encoding: chunked\r\n\r\n").into_bytes();
    (0..20).for_each(|_| endless.extend_from_slice(&chunk));
    // The answer may be lost where more is written than it reads.
    assert!(matches!(studio.raw(&endless).status, 413 | 0));
    let deep = studio.post("api/document", &vec![b'['; 1 << 20]);
    assert_eq!(deep.status, 422);
    let long = format!("/{token}/{}", "a".repeat(100_000));
    assert!(matches!(studio.request("GET", &long, "", b"").status, 414 | 431 | 400 | 0));

    // Connections that say nothing, half of something or nonsense, and go.
    for index in 0..1000 {
        let mut stream = studio.connect();
        let _ = match index % 4 {
            0 => Ok(()),
            1 => stream.write_all(b"GET / HT"),
            2 => stream.write_all(format!("{head}Content-Length: 1000000\r\n\r\n{{").as_bytes()),
            _ => stream.write_all(&[0xff; 100]),
        };
    }
    // And more at once than it takes, while others are still served.
    let open: Vec<_> = (0..50).map(|_| studio.connect()).collect();
    assert_eq!(studio.get("api/document").status, 200);
    drop(open);

    let answer = studio.post("api/document", good.to_string().as_bytes());
    assert_eq!(answer.status, 200, "it still works");
    let revision = answer.json()["revision"].clone();
    studio.events(|name, data| {
        name == "frame" && data["done"] == true && data["revision"] == revision
    });
    let after = studio.memory();
    assert!(
        after < before + GROWTH,
        "{} MB before and {} MB after, expected {} MB more at most",
        before >> 20,
        after >> 20,
        GROWTH >> 20
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_it_while_it_draws_and_while_somebody_listens() {
    let mut studio = Studio::start(&["preset:silk-shantung"]);
    let mut listener = studio.connect();
    let (token, address) = (&studio.token, studio.address);
    write!(listener, "GET /{token}/api/events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut first = [0; 12];
    listener.read_exact(&mut first).unwrap();
    assert_eq!(&first, b"HTTP/1.1 200");
    let pid = studio.child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let asked = Instant::now();
    let status = loop {
        match studio.child.try_wait().unwrap() {
            Some(status) => break status,
            None if asked.elapsed() > Duration::from_secs(60) => panic!("it goes on"),
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    assert_eq!(status.code(), Some(0));
    assert!(TcpStream::connect(studio.address).is_err(), "nobody listens any more");
}

#[test]
fn it_ends_when_nobody_has_looked_for_long() {
    let mut studio = Studio::start(&["preset:cotton-twill", "--idle-exit", "300ms"]);
    assert_eq!(studio.child.wait().unwrap().code(), Some(0));
}
