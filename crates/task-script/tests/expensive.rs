//! Scripts with the most expensive statements: each ends within its budget, and soon after the
//! host stops it.
//!
//! `SWARM_TEST_SCRIPTS` sets their number.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    cell::Cell,
    rc::Rc,
    sync::mpsc::{RecvTimeoutError, channel},
    thread,
    time::Duration,
};

use task_script::{Host, Limits, Meter, Name, Object, Program, ScriptError, Value, Vocabulary};

/// A seventieth of the work that scripts of experiments may do, and the memory of experiments with
/// many robots.
const LIMITS: Limits = Limits { work: 40_000, memory: 1 << 20 };
/// Longest time of a script on a busy machine. The work takes a few milliseconds; a script with
/// uncounted work would take minutes.
const PATIENCE: Duration = Duration::from_secs(20);

/// A host without a world; it lets the script continue this many times.
struct Nowhere(Cell<u32>);

impl Host for Nowhere {
    fn get(&mut self, _: Object, _: Name, _: &Rc<Meter>) -> Result<Value, String> {
        Ok(Value::Int(7))
    }

    fn set(&mut self, _: Object, _: Name, _: Value) -> Result<(), String> {
        Err("it cannot be changed".into())
    }

    fn call(&mut self, _: Object, _: Name, _: &[Value], _: &Rc<Meter>) -> Result<Value, String> {
        Ok(Value::Nothing)
    }

    fn goes_on(&mut self) -> bool {
        self.0.set(self.0.get().saturating_sub(1));
        self.0.get() > 0
    }
}

fn run(text: &str, limits: Limits, mut host: Nowhere) -> Result<(), ScriptError> {
    let program = Program::compile("t.star", text, &Vocabulary { names: &["heading"] })
        .unwrap_or_else(|errors| panic!("{}\n{text}", errors[0]));
    let mut script = program.start(limits, &mut host)?;
    let function = program.function("main").unwrap();
    script.call(&program, function, &[], &mut host).map(drop)
}

/// Long texts, lists and dicts, within the memory of a script.
const VALUES: &str = "
    t = 'abcdefgh'
    for i in range(LENGTH): t = t + t
    u = t + 'x'
    v = t + 'y'
    texts = [u, v, u, t + 'z', v + 'a']
    n = 0
    numbers = [(i * 7919) % 1009 for i in range(COUNT)]
    floats = [i * 0.5 for i in numbers]
    pairs = [(i % 3, u) for i in range(20)]
    d = {i: i for i in range(COUNT)}
    e = {u: 1, v: 2}
    p = (u, v)
    q = (t + 'x', t + 'y')
    for i in range(6):
        p = (p, p)
        q = (q, q)
";

/// Expressions that cost more than a statement.
const EXPRESSIONS: [&str; 47] = [
    "u < v",
    "u >= v",
    "u == v",
    "u != t + 'x'",
    "u in e",
    "v not in e",
    "e.get(u)",
    "e[v]",
    "e.get((u, v), 0)",
    "'zz' in u",
    "t + u",
    "sorted(texts)",
    "sorted(texts, reverse=True)",
    "sorted(texts, key=lambda x: x)",
    "sorted(numbers)",
    "sorted(floats, key=lambda x: -x)",
    "min(texts)",
    "max(u, v, u, v)",
    "max(numbers, key=lambda x: x % 7)",
    "min(numbers)",
    "numbers + numbers",
    "numbers[1:]",
    "texts[:3] == texts[:3]",
    "numbers == [x for x in numbers]",
    "pairs == [x for x in pairs]",
    "p == q",
    "p in [q]",
    "p in d",
    "{p: 1}",
    "-1 in numbers",
    "numbers.index(8)",
    "texts.index(v + 'a')",
    "sum(numbers)",
    "zip(numbers, numbers)",
    "enumerate(numbers)",
    "reversed(numbers)",
    "list(d)",
    "e.keys()",
    "e.items()",
    "d.values()",
    "d.pop(n, 0)",
    "{x: 1 for x in texts}",
    "range(500)",
    "1e308 % 1e-300",
    "math.sin(1e300) + math.pow(1.1, 300.7)",
    "wide()",
    "deep(12)",
];

/// Functions with many variables, and with nested calls.
fn functions() -> String {
    let variables: Vec<String> = (0..700).map(|n| format!("a{n}=0")).collect();
    let variables = variables.join("; ");
    format!(
        "def wide():\n    if False: {variables}\n    return 0\n\n\
         def deep(n):\n    return deep(n - 1) if n else wide()\n\n"
    )
}

/// Splitmix64.
struct Draw(u64);

impl Draw {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

/// A script that repeats one expensive expression in each statement, as often as its text has
/// room for.
fn extreme(expression: &str, functions: &str) -> String {
    let values = VALUES.replace("LENGTH", "13").replace("COUNT", "800");
    let line = vec![expression; 18_000 / (expression.len() + 2)].join(", ");
    format!("{functions}def main():{values}    for i in range(30000):\n        x = [{line}]\n")
}

/// A script that evaluates a few expensive expressions very often: in one statement, in a
/// comprehension, or in a sort.
fn expensive(draw: &mut Draw, functions: &str) -> String {
    let values = VALUES
        .replace("LENGTH", &draw.below(14).to_string())
        .replace("COUNT", &(1 + draw.below(800)).to_string());
    let n_kinds = 1 + draw.below(3);
    let kinds: Vec<&str> =
        (0..n_kinds).map(|_| EXPRESSIONS[draw.below(EXPRESSIONS.len())]).collect();
    let longest = kinds.iter().map(|kind| kind.len()).max().unwrap_or(1);
    let n_times = 1 + draw.below(14_000 / (longest + 2));
    let line: Vec<&str> = (0..n_times).map(|_| kinds[draw.below(kinds.len())]).collect();
    let line = line.join(", ");
    let body = match draw.below(4) {
        0 => format!("for i in range(30000):\n        x = [{line}]"),
        1 => format!("x = [[{line}] == 0 for i in range(30000)]"),
        2 => format!("x = sorted(range(2000), key=lambda n: len([{line}]))"),
        _ => format!("for i in range(30000):\n        if [{line}] == i: pass"),
    };
    format!("{functions}def main():{values}    {body}\n    return 1\n")
}

/// Largest allowed peak memory of this process, KiB; a script may keep one MiB.
const PEAK_KIB: u64 = 128 << 10;

#[test]
fn what_a_script_does_not_keep_takes_little_memory() {
    let values = VALUES.replace("LENGTH", "13").replace("COUNT", "1");
    let deeper = "    for i in range(6):\n        p = (p, p)\n";
    let many = vec!["u"; 6000].join(", ");
    for line in ["    p in {}".into(), "    {p: 1}".into(), format!("    fail({many})")] {
        let text = format!("def main():{values}{deeper}{line}\n");
        let limits = Limits { work: 3_000_000, ..LIMITS };
        let error = run(&text, limits, Nowhere(Cell::new(u32::MAX))).unwrap_err();
        let known = ["keeps too much", "abcdefgh"];
        assert!(known.iter().any(|message| error.message.contains(message)), "{error}");
    }
    // Not every system reports the peak memory.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    if let Some(peak) = status.lines().find_map(|line| line.strip_prefix("VmHWM:")) {
        let peak: u64 = peak.trim().trim_end_matches(" kB").parse().unwrap();
        assert!(peak < PEAK_KIB, "{peak} KiB");
    }
}

#[test]
fn expensive_scripts_end_within_their_budget() {
    let n = std::env::var("SWARM_TEST_SCRIPTS").map_or(300, |n| n.parse().unwrap());
    let (next, started) = channel();
    let trying = thread::spawn(move || {
        let (mut draw, functions) = (Draw(1), functions());
        let mut n_ended = 0;
        for number in 0..n {
            let text = match EXPRESSIONS.get(number) {
                Some(expression) => extreme(expression, &functions),
                None => expensive(&mut draw, &functions),
            };
            next.send(text.clone()).unwrap();
            if let Err(error) = run(&text, LIMITS, Nowhere(Cell::new(u32::MAX))) {
                let known = ["does too much", "keeps too much", "no such element"];
                assert!(
                    known.iter().any(|message| error.message.contains(message)),
                    "{error}\n{text}"
                );
                n_ended += 1;
            }
        }
        assert!(n_ended > n / 2, "{n_ended} of {n} used up their budget");
    });
    let mut latest = String::new();
    loop {
        match started.recv_timeout(PATIENCE) {
            Ok(text) => latest = text,
            Err(RecvTimeoutError::Timeout) => panic!("this script does not end:\n{latest}"),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    trying.join().unwrap();
}

#[test]
fn every_expression_ends_when_the_host_stops_the_script() {
    let functions = functions();
    let without_end = Limits { work: u64::MAX / 1000, memory: 16 << 20 };
    for (number, expression) in EXPRESSIONS.iter().enumerate() {
        let values = VALUES.replace("LENGTH", "11").replace("COUNT", "200");
        let loops = "for i in range(1500):\n        for j in range(1500): x = ";
        let text = format!("{functions}def main():{values}    {loops}[{expression}]\n");
        let error = run(&text, without_end, Nowhere(Cell::new(4 + number as u32 % 3)));
        let error = error.expect_err(&text).message;
        assert!(error.contains("was stopped") || error.contains("no such element"), "{error}");
    }
}

#[test]
fn expensive_texts_compile_in_a_moment() {
    let many = |n: usize, with: &dyn Fn(usize) -> String| (0..n).map(with).collect::<String>();
    let nested = "[[[[1 for x in y] for y in z] for z in w]] + ".repeat(600);
    for text in [
        // Unknown names beside many known ones.
        format!("def main():\n    return [{}]", many(4000, &|n| format!("n{n},"))),
        many(2200, &|n| format!("a{n}=b{n}\n")),
        many(1200, &|n| format!("def f{n}():\n    g{n}()\n")),
        format!("def main():\n    {}", many(3000, &|n| format!("x.a{n};"))),
        format!("def main():\n    return {}1{}", "[".repeat(60), ", 1]".repeat(60)),
        format!("def main():\n    return {nested}1"),
    ] {
        assert!(text.len() <= task_script::TEXT_BYTES, "{}", text.len());
        let (done, compiled) = channel();
        let to_compile = text.clone();
        thread::spawn(move || {
            let vocabulary = Vocabulary { names: &["heading"] };
            let program = Program::compile("t.star", &to_compile, &vocabulary);
            done.send(program.map(drop).map_err(|errors| errors.len())).unwrap();
        });
        let result = compiled.recv_timeout(PATIENCE);
        let result = result.unwrap_or_else(|_| panic!("does not end: {}", &text[..60]));
        if let Err(n_problems) = result {
            assert!(n_problems <= 21, "{n_problems}");
        }
    }
}
