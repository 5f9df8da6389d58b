//! `luxel view`: from a bake to its page.

use super::*;

#[test]
fn a_bake_becomes_a_page() {
    let folder = Folder::new();
    let baked = folder.path("baked");
    let cornell = example("cornell");
    let bake = [
        "bake", &cornell, "-o", &baked, "--size", "64", "--error", "20%", "--for", "three",
    ];
    assert_eq!(luxel(&bake).0, ExitCode::Ok);

    let (exit, stdout, stderr) = luxel(&["view", &baked]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let page = fs::read(format!("{baked}/view.html")).expect("the page");
    assert!(stdout.trim().ends_with("view.html"));

    let other = folder.path("other.html");
    let (exit, stdout, _) = luxel(&["--json", "view", &baked, "-o", &other]);
    assert_eq!(exit, ExitCode::Ok);
    assert_eq!(json(&stdout)["bytes"], page.len());
    assert_eq!(fs::read(&other).expect("the page"), page);
    // Scene and maps are small here: the rest is three.js.
    assert!(page.len() < 900_000, "{}", page.len());
}

#[test]
fn what_is_no_bake_is_refused() {
    let folder = Folder::new();
    let page = folder.path("view.html");
    let (exit, _, stderr) = luxel(&["view", &folder.path("."), "-o", &page]);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(stderr.contains("luxel bake SCENE -o"), "{stderr}");
    folder.write("manifest.json", "{\"schema\": 9}");
    let (exit, _, stderr) = luxel(&["view", &folder.path("."), "-o", &page]);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(stderr.contains("schema 9"), "{stderr}");
    assert!(fs::read(&page).is_err(), "no page of nothing");
}

/// What the command prints, for another thread to read while it runs.
#[derive(Clone, Default)]
struct Shared(std::sync::Arc<std::sync::Mutex<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("nobody panicked").write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Shared {
    /// The first line, as soon as it is there; `None` when nothing comes.
    fn line(&self) -> Option<String> {
        for _ in 0..500 {
            let text = self.0.lock().expect("nobody panicked").clone();
            let text = String::from_utf8(text).expect("text");
            if let Some((line, _)) = text.split_once('\n') {
                return Some(line.to_owned());
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        None
    }
}

#[test]
fn a_page_is_served_until_it_is_ended() {
    let folder = Folder::new();
    let baked = folder.path("baked");
    let cornell = example("cornell");
    let bake = [
        "bake", &cornell, "-o", &baked, "--size", "64", "--error", "20%", "--for", "bevy",
    ];
    assert_eq!(luxel(&bake).0, ExitCode::Ok);
    let (exit, _, stderr) = luxel(&["view", &baked]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let page = fs::read(format!("{baked}/view.html")).expect("the page");

    let (stdout, interrupt) = (Shared::default(), Interrupt::default());
    let answer = std::thread::scope(|scope| {
        let running = scope.spawn(|| {
            let args = ["luxel", "view", &baked, "--serve"];
            let (mut stdout, mut stderr) = (stdout.clone(), Vec::new());
            run_with(args, &mut stdout, &mut stderr, false, interrupt.clone())
        });
        let answer = stdout.line().map(|url| {
            let address = url.trim_start_matches("http://").trim_end_matches('/');
            let mut stream = std::net::TcpStream::connect(address).expect("it listens");
            let request = format!("GET / HTTP/1.1\r\nHost: {address}\r\n\r\n");
            stream.write_all(request.as_bytes()).expect("sent");
            stream
                .shutdown(std::net::Shutdown::Write)
                .expect("all is said");
            let mut answer = Vec::new();
            std::io::Read::read_to_end(&mut stream, &mut answer).expect("an answer");
            answer
        });
        // Only with somebody listening is it a wish; else it would end the tests.
        if answer.is_some() {
            interrupt.raise(ExitCode::Interrupted as i32);
        }
        assert_eq!(running.join().expect("it ends"), ExitCode::Ok);
        answer
    });
    assert!(answer.expect("a URL").ends_with(&page), "the same page");
    let both = ["view", &baked, "--serve", "-o", "x.html"];
    assert_eq!(luxel(&both).0, ExitCode::Usage);
    assert_eq!(luxel(&["view", &baked, "--port", "80"]).0, ExitCode::Usage);
}
