//! Who may ask: those who know the token, and who mean this address.

use std::{fmt, net::SocketAddr};

use anyhow::anyhow;
use hyper::{HeaderMap, Uri, header};

/// The header that may carry the token.
const HEADER: &str = "x-selvedge-token";

/// Bytes of a token before they are written in hexadecimal.
const TOKEN_BYTES: usize = 16;

/// What lets requests in.
pub(super) struct Guard {
    token: String,
    /// What `Host` may say: the names of the address. A page of another site that has got itself
    /// resolved to it (DNS rebinding) says its own.
    hosts: Vec<String>,
    /// The port, where any address of this machine is listened on: then any that is written in digits
    /// will do, which a name that was resolved to it is not.
    open_port: Option<u16>,
}

impl fmt::Debug for Guard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Guard").field("hosts", &self.hosts).finish_non_exhaustive()
    }
}

impl Guard {
    /// A new token for the studio at `address`.
    ///
    /// # Errors
    ///
    /// When the system has no random numbers.
    pub(super) fn new(address: SocketAddr) -> anyhow::Result<Self> {
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes).map_err(|error| anyhow!("token: {error}"))?;
        let token = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let mut hosts = vec![address.to_string()];
        if address.ip().is_loopback() {
            hosts.push(format!("localhost:{}", address.port()));
        }
        let open_port = address.ip().is_unspecified().then(|| address.port());
        Ok(Self { token, hosts, open_port })
    }

    /// The token.
    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// The path that is asked for, without the token that may stand before it; `None` if the request
    /// is not let in.
    pub(super) fn admit<'a>(&self, uri: &'a Uri, headers: &HeaderMap) -> Option<&'a str> {
        self.is_meant(uri, headers).then_some(())?;
        let path = uri.path();
        let (first, rest) = path.strip_prefix('/')?.split_once('/').unwrap_or_default();
        if self.is_token(first) {
            return Some(&path[path.len() - rest.len() - 1..]);
        }
        let in_query = uri.query().into_iter().flat_map(|query| query.split('&'));
        let in_query = in_query.filter_map(|pair| pair.strip_prefix("token="));
        let in_header = headers.get(HEADER).and_then(|value| value.to_str().ok());
        in_query.chain(in_header).any(|found| self.is_token(found)).then_some(path)
    }

    /// Whether host and origin are this address.
    fn is_meant(&self, uri: &Uri, headers: &HeaderMap) -> bool {
        let is_open = |host: &str| {
            let named = host.parse::<SocketAddr>().ok().map(|address| address.port());
            named.is_some() && named == self.open_port
        };
        let is_ours = |host: &str| {
            self.hosts.iter().any(|own| host.eq_ignore_ascii_case(own)) || is_open(host)
        };
        let mut hosts = headers.get_all(header::HOST).iter();
        let host = hosts.next().and_then(|host| host.to_str().ok());
        let is_single = hosts.next().is_none();
        let mut origins = headers.get_all(header::ORIGIN).iter();
        let is_own_origin = origins.all(|origin| {
            origin
                .to_str()
                .ok()
                .and_then(|origin| origin.strip_prefix("http://"))
                .is_some_and(is_ours)
        });
        let is_own_authority = uri.authority().is_none_or(|authority| is_ours(authority.as_str()));
        host.is_some_and(is_ours) && is_single && is_own_origin && is_own_authority
    }

    /// Whether `found` is the token, in a time that does not tell how much of it is right.
    fn is_token(&self, found: &str) -> bool {
        let difference = self.token.bytes().zip(found.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
        found.len() == self.token.len() && difference == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn admits(guard: &Guard, uri: &str, headers: &[(&'static str, &str)]) -> Option<String> {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(*name, value.parse().unwrap());
        }
        guard.admit(&uri.parse().unwrap(), &map).map(str::to_owned)
    }

    #[test]
    fn token_and_host_let_in_and_nothing_else() {
        let guard = Guard::new("127.0.0.1:8000".parse().unwrap()).unwrap();
        let t = guard.token();
        assert_eq!(t.len(), 32);
        let host = ("host", "127.0.0.1:8000");
        let at = |uri: &str| admits(&guard, uri, &[host]);
        assert_eq!(at(&format!("/?token={t}")).as_deref(), Some("/"));
        assert_eq!(at(&format!("/{t}/api/at?x=1")).as_deref(), Some("/api/at"));
        assert_eq!(at(&format!("/{t}/")).as_deref(), Some("/"));
        assert_eq!(at(&format!("/api/at?x=1&token={t}")).as_deref(), Some("/api/at"));
        let by_header = admits(&guard, "/x", &[("host", "LocalHost:8000"), (HEADER, t)]);
        assert_eq!(by_header.as_deref(), Some("/x"));
        let wrong = format!("{}{}", &t[1..], &t[..1]);
        for uri in
            ["/", "/?token=", "/api/at", "//", &format!("/?token={t}0"), &format!("/{}", &t[..31])]
        {
            assert_eq!(at(uri), None, "{uri}");
        }
        // Only if all its digits are the same is a rotated token the token.
        assert_eq!(at(&format!("/?token={wrong}")).is_some(), wrong == t);
        let good = format!("/?token={t}");
        for headers in [
            &[][..],
            &[("host", "127.0.0.1:8001")],
            &[("host", "evil.example:8000")],
            &[("host", "127.0.0.1")],
            &[host, host],
            &[host, ("origin", "http://evil.example")],
            &[host, ("origin", "https://127.0.0.1:8000")],
            &[host, ("origin", "null")],
        ] {
            assert_eq!(admits(&guard, &good, headers), None, "{headers:?}");
        }
        assert_eq!(admits(&guard, &format!("http://evil.example{good}"), &[host]), None);
        let own = ("origin", "http://127.0.0.1:8000");
        assert!(admits(&guard, &good, &[host, own]).is_some());

        let open = Guard::new("0.0.0.0:8000".parse().unwrap()).unwrap();
        let good = format!("/?token={}", open.token());
        for (host, is_in) in [
            ("192.168.1.7:8000", true),
            ("[fe80::1]:8000", true),
            ("192.168.1.7:8001", false),
            ("evil.example:8000", false),
        ] {
            assert_eq!(admits(&open, &good, &[("host", host)]).is_some(), is_in, "{host}");
        }
    }
}
