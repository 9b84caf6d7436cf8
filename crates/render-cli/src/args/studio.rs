//! The command line of `selvedge studio`.

use std::{
    net::{IpAddr, Ipv4Addr},
    path::PathBuf,
    time::Duration,
};

use clap::Args;

/// Arguments of `selvedge studio`.
#[derive(Clone, Debug, Args)]
pub struct StudioOptions {
    /// What is shown: a draft (WIF), a fabric (JSON), which can be saved, or preset:NAME
    #[arg(value_name = "CLOTH", default_value = "preset:denim")]
    pub input: PathBuf,

    /// The port to listen on; 0 takes a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub port: u16,

    /// The address to listen on: others than loopback let other machines in that know the whole address
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    pub host: IpAddr,

    /// Leaves it to you to open the page
    #[arg(long)]
    pub no_open: bool,

    /// Ends when nobody has looked for so long, as in 90s, 2m or 1h
    #[arg(long, value_name = "TIME", value_parser = super::effort::time)]
    pub idle_exit: Option<Duration>,

    /// Threads to draw with [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}
