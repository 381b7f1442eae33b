//! Sends the requests of open pages as often as browsers do.

use std::{
    net::SocketAddr,
    thread::{self, JoinHandle},
    time::Duration,
};

use tokio::{
    io::{self, AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    runtime,
    sync::watch,
    task::JoinSet,
    time,
};

/// Interval between requests for values that no stream brings.
const LOOK_EVERY: Duration = Duration::from_secs(2);
/// Time until all pages have loaded the earlier data.
const LOADING: Duration = Duration::from_secs(5);

/// Open pages, read by a thread of their own; dropping this closes them.
pub struct OpenPages {
    close: watch::Sender<bool>,
    reader: Option<JoinHandle<()>>,
}

impl OpenPages {
    /// Opens `n` pages, and waits until they have loaded. Every fifth is the page of the fleet, the
    /// others are of the first experiment.
    pub async fn open(address: SocketAddr, n: usize) -> Self {
        let (close, mut closed) = watch::channel(false);
        let reader = thread::spawn(move || {
            let runtime = runtime::Builder::new_current_thread().enable_all().build();
            runtime.expect("a runtime").block_on(async {
                let mut pages = JoinSet::new();
                for page in 0..n {
                    pages.spawn(async move {
                        let looks: &[&str] = if page % 5 == 0 {
                            &["workers", "timeline", "experiments", "experiments/1/explain"]
                        } else {
                            tokio::spawn(get(address, "experiments/1/live?from=0"));
                            &["experiments/1", "experiments/1/events", "experiments/1/explain"]
                        };
                        let mut ticks = time::interval(LOOK_EVERY);
                        loop {
                            ticks.tick().await;
                            for path in looks {
                                get(address, path).await.expect("the coordinator serves pages");
                            }
                        }
                    });
                }
                closed.wait_for(|closed| *closed).await.expect("it is closed before it is gone");
            });
        });
        time::sleep(LOADING).await;
        Self { close, reader: Some(reader) }
    }
}

impl Drop for OpenPages {
    fn drop(&mut self) {
        self.close.send_replace(true);
        let reader = self.reader.take().expect("nobody else takes it");
        reader.join().expect("pages can be read");
    }
}

/// Sends a request, and reads the whole answer.
async fn get(address: SocketAddr, path: &'static str) -> io::Result<()> {
    let mut stream = TcpStream::connect(address).await?;
    let request =
        format!("GET /api/{path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    let mut status = [0; 12];
    stream.read_exact(&mut status).await?;
    assert_eq!(&status, b"HTTP/1.1 200", "{path}");
    io::copy(&mut stream, &mut io::sink()).await?;
    Ok(())
}
