//! The results of scripts, and the errors of faulty scripts.

use super::*;

/// A host without a world, which these scripts do not need.
struct Nowhere;

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
}

const LIMITS: Limits = Limits { work: 20_000, memory: 1 << 18 };
const VOCABULARY: Vocabulary = Vocabulary { names: &["heading", "neighbours"] };
const THING: Value = Value::Object(Object { kind: 0, index: 0 });

fn compile(text: &str) -> Result<Program, Vec<ScriptError>> {
    Program::compile("t.star", text, &VOCABULARY)
}

/// The result of the last function of a text, and the memory in use afterwards.
fn run_measured(text: &str) -> (Result<Value, ScriptError>, usize) {
    let program = compile(text).unwrap_or_else(|errors| panic!("{text}\n{}", errors[0]));
    let function = FunctionId(program.functions.len() - 1);
    let mut script = match program.start(LIMITS, &mut Nowhere) {
        Ok(script) => script,
        Err(error) => return (Err(error), 0),
    };
    let before = script.meter.memory();
    let arguments = vec![THING; program.functions[function.0].n_parameters];
    let value = script.call(&program, function, &arguments, &mut Nowhere);
    let meter = Rc::clone(script.meter());
    let n_kept = meter.memory() - before;
    if value.is_err() {
        drop(script);
        assert_eq!(meter.memory(), 0, "all memory is released: {text}");
    }
    (value, n_kept)
}

fn run(text: &str) -> Result<Value, ScriptError> {
    run_measured(text).0
}

/// Whether a condition holds after some statements; both are also valid Python.
fn holds(statements: &str, condition: &str) -> bool {
    let statements = statements.replace('\n', "\n    ");
    let text = format!("def f(x):\n    {statements}\n    return {condition}");
    run(&text).unwrap_or_else(|error| panic!("{text}\n{error}")).is_true()
}

#[test]
fn scripts_compute_the_same_as_python() {
    let cases = [
        ("a = 7", "a // 2 == 3 and -a // 2 == -4 and a // -2 == -4 and -a // -2 == 3"),
        ("a = 7", "a % 3 == 1 and -a % 3 == 2 and a % -3 == -2 and -7.5 % 2 == 0.5"),
        ("a = 7", "a / 2 == 3.5 and a * 2 == 14 and a - 10 == -3 and 1 == 1.0"),
        ("a, (b, c) = 1, [2, 3]", "[c, b, a] == [3, 2, 1] and (a, b) == (1, 2)"),
        ("a = [i * i for i in range(5) if i % 2 == 0]", "a == [0, 4, 16] and len(a) == 3"),
        ("a = [(i, j) for i in range(3) for j in range(i)]", "a == [(1, 0), (2, 0), (2, 1)]"),
        ("a = {k: v for k, v in [('x', 1), ('y', 2)]}", "a['y'] == 2 and a.keys() == ['x', 'y']"),
        ("a = {}\na[1] = 'b'\na[(1, 2)] = 3", "a[1.0] == 'b' and a[(1, 2)] == 3 and 2 not in a"),
        ("a = {'n': 1}\na['n'] += 2\nb = a.pop('n')", "b == 3 and a.get('n', 5) == 5 and not a"),
        ("a = [3, 1, 2]\na.append(0)\nb = sorted(a)", "a == [3, 1, 2, 0] and b == [0, 1, 2, 3]"),
        ("a = sorted([3, -1, 2], key=lambda n: n * n, reverse=True)", "a == [3, 2, -1]"),
        ("a = min([4, -5], key=abs_of)", "a == 4 and max(1, 2.5) == 2.5 and min([2, 1]) == 1"),
        (
            "a = [1, 2, 3, 4]",
            "a[-1] == 4 and a[1:3] == [2, 3] and a[:-1] == [1, 2, 3] and a[2:] == [3, 4]",
        ),
        ("a = [1]\nb = a\na.extend([3])", "b == [1, 3]"),
        (
            "a = 0\nfor i in range(10):\n    if i == 2:\n        continue\n    if i == 5: break\n    a += i",
            "a == 8",
        ),
        ("a = 1 if x else 2\nb = 'y' if [] else 'n'", "a == 1 and b == 'n' and (0 or 3) == 3"),
        ("a = range(10, 0, -3)", "a == [10, 7, 4, 1] and range(3, 3) == [] and sum(a) == 22"),
        ("a = enumerate('ab' and ['p', 'q'])", "a == [(0, 'p'), (1, 'q')]"),
        ("a = zip([1, 2], [3, 4, 5])", "a == [(1, 3), (2, 4)] and reversed(a) == [(2, 4), (1, 3)]"),
        (
            "a = math.sqrt(2.0)",
            "abs(a * a - 2) < 1e-15 and math.floor(-1.5) == -2 and int(-1.5) == -1",
        ),
        (
            "a = math.atan2(1, -1)",
            "a == 0.75 * math.pi and math.cos(0) == 1 and math.ceil(1.1) == 2",
        ),
        (
            "a = 'le' + \"ft\"",
            "a == 'left' and 'ef' in a and 'a' < 'b' and any([0, 1]) and not all([0, 1])",
        ),
        ("n = 0\nfor i in [1, 2]:\n    if n > 0:\n        m = p\n    p = i\n    n += 1", "m == 1"),
        ("i = 5\na = [i for i in range(3)]", "i == 5 and a == [0, 1, 2]"),
    ];
    for (statements, condition) in cases {
        let statements = statements.replace("abs_of", "g");
        let statements = statements.replace('\n', "\n    ");
        let text = format!(
            "def g(n):\n    return abs(n)\n\ndef f(x):\n    {statements}\n    return {condition}"
        );
        let value = run(&text).unwrap_or_else(|error| panic!("{text}\n{error}"));
        assert!(value.is_true(), "{statements}: {condition}");
    }
}

/// The documentation names both, and old scripts keep their bits.
#[test]
fn two_operators_differ_from_python() {
    assert!(holds("a = [1]\nb = a\nb += [2]", "b == [1, 2] and a == [1]"));
    assert!(holds("a = 1 // 0.1", "a == 10 and 1 % 0.1 < 0.1"));
}

#[test]
fn functions_may_stand_in_any_order_and_constants_are_shared() {
    let text = "N = 2\ndef twice(n):\n    return N * half(n)\ndef half(n): return n / 2\n\
                def f(x):\n    \"\"\"What it does.\"\"\"\n    return twice(21) == 21";
    assert!(run(text).unwrap().is_true());
}

#[test]
fn all_unknown_names_are_reported_at_once_with_suggestions() {
    let text = "def fitness(world):\n    n = lenn([1])\n    return hedaing(n) + wrold.heading\n    \
                n.haeding\n    math.cos(1)\n";
    let errors: Vec<String> = compile(text).unwrap_err().iter().map(ToString::to_string).collect();
    let expected = [
        "t.star:2: no function is named `lenn`; did you mean `len`?",
        "t.star:3: no function is named `hedaing`; ",
        "t.star:3: unknown name `wrold`; did you mean `world`?",
        "t.star:4: no object has a `haeding`; did you mean `heading`?",
    ];
    assert_eq!(errors.len(), expected.len(), "{errors:?}");
    for (error, expected) in errors.iter().zip(expected) {
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn missing_features_of_python_are_refused_with_their_replacement() {
    for (line, expected) in [
        ("while x:", "there is no `while`"),
        ("import os", "imports nothing"),
        ("return x ** 2", "use `math.pow(a, b)`"),
        ("return 1 < 2 < 3", "not chained"),
        ("return x is None", "end of the line"),
        ("return lambda y: y", "only be the `key`"),
        ("print(x)", "nothing can be printed"),
        ("def g(): pass", "contain another"),
        ("return g'{x}'", "end of the line"),
        ("x = y = 1", "one `=`"),
        ("return sorted(x, cmp=1)", "by position"),
        ("break", "belongs in a `for`"),
        ("f(1, 2)", "takes 1 arguments, found 2"),
        ("len = 3", "is taken"),
        ("return math.sine(1)", "`math` has no `sine`; did you mean `sin`?"),
        ("return x(1)", "no function is named `x`"),
        ("return f", "call it"),
    ] {
        let errors = compile(&format!("def f(x):\n    {line}\n")).unwrap_err();
        assert!(errors[0].message.contains(expected), "{line}: {}", errors[0]);
        assert_eq!(errors[0].line, 2, "{line}");
    }
}

#[test]
fn errors_name_their_line_and_reason() {
    for (line, expected) in [
        ("return 1 / (x.heading - 7)", "division by zero"),
        ("return [1][3]", "there is no element 3 in a list of 1"),
        ("return {'a': 1}['b']", "the dict has no key \"b\""),
        ("return 'a' + 1", "`+` does not take string and int"),
        ("return x.neighbours + 1", ""),
        ("return len(3)", "an int has no length"),
        ("if False: y = 1\n    return y", "has no value yet"),
        ("a, b = [1]", "1 values for 2 names"),
        ("return 9000000000000000000 * 9", "more than 64 bits"),
        ("return f(x)", "more than 16 nested calls"),
        ("x.heading = 3", "cannot be changed"),
        ("C.append(1)", "constant"),
        ("return sorted([1, 'a'])", "have no order"),
        ("return max([])", "empty"),
        ("fail('robot', 3, 'is lost')", "robot 3 is lost"),
        ("return int(1e300)", "not a whole number of 64 bits"),
        ("return [1, 2].push(1)", ""),
        ("return -[1]", "`-` takes a number"),
        ("for i in 3: pass", "expected a list, found int"),
        ("return {[]: 1}", "cannot be a key"),
    ] {
        if expected.is_empty() {
            continue;
        }
        let error = run(&format!("C = [1]\ndef f(x):\n    {line}\n")).unwrap_err();
        assert!(error.message.contains(expected), "{line}: {error}");
        assert!([3, 4].contains(&error.line), "{line}: {error}");
    }
}

#[test]
fn values_without_an_order_are_refused_and_large_numbers_are_sorted() {
    // Long enough for the sort to notice an inconsistent order.
    let nan =
        "n = math.inf - math.inf\n    l = [n if i % 7 == 3 else (i * 31) % 50 for i in range(90)]";
    for (l, expected) in [
        (nan, "NaN (not a number) has no order"),
        ("l = [str_of[i % 2] for i in range(90)]", "an int and a string have no order"),
        ("l = [[i] for i in range(90)]", "a list and a list have no order"),
    ] {
        let l = l.replace("str_of", "[1, 'a']");
        let error = run(&format!("def f(x):\n    {l}\n    return sorted(l)")).unwrap_err();
        assert!(error.message.contains(expected), "{l}: {error}");
    }
    // Different whole numbers that round to the same float.
    let large =
        "b = 9007199254740992\nl = [b + i % 3 if i % 2 else (b + i % 3) * 1.0 for i in range(90)]";
    assert!(holds(large, "sorted(l)[0] == b and sorted([2, 1.5, 1]) == [1, 1.5, 2]"));
}

#[test]
fn runaway_scripts_end() {
    for body in [
        "for i in range(1000):\n        for j in range(1000):\n            x",
        "return [i for i in range(1000) for j in range(1000)]",
        "return range(1000000000000)",
        "l = [1]\n    for i in l: l.append(i)\n    for i in range(60): l = l + l",
        "a = []\n    b = []\n    for i in range(60):\n        a = [a, a]\n        b = [b, b]\n    return a == b",
        "t = (1, 1)\n    for i in range(60): t = (t, t)\n    return {t: 1}",
        "s = 'x'\n    for i in range(60): s = s + s",
        "return sorted(range(19000))",
        "d = {}\n    for i in range(15000): d[i] = [i]",
        "l = []\n    for i in range(9000): l.append([i, i, i])",
    ] {
        let error = run(&format!("def f(x):\n    {body}\n    return 1")).unwrap_err();
        let expected = ["does too much", "keeps too much", "nested this deep", "cannot be a key"];
        assert!(expected.iter().any(|message| error.message.contains(message)), "{body}: {error}");
    }
}

#[test]
fn lists_that_are_deep_or_hold_themselves_are_dropped() {
    for body in [
        "l = []\n    for i in range(900): l = [l]",
        "l = []\n    for i in range(900):\n        n = []\n        l.append(n)\n        l = n",
        "l = []\n    d = {}\n    l.append(d)\n    d['l'] = l\n    d['d'] = d",
    ] {
        let (value, _) = run_measured(&format!("def f(x):\n    {body}\n    fail('the end')"));
        assert_eq!(value.unwrap_err().message, "the end", "{body}");
    }
    let (value, n_kept) = run_measured("def f(x):\n    l = [[1], {'a': (2, 'b')}]\n    return 1");
    assert_eq!((value.unwrap().number(), n_kept), (Some(1.0), 0));
}

#[test]
fn texts_that_are_too_deep_or_too_long_are_refused() {
    let nested = |open: &str, close: &str, n| {
        format!("def f(x):\n    return {}1{}", open.repeat(n), close.repeat(n))
    };
    for text in [
        nested("(", ")", 5000),
        nested("[", "]", 5000),
        nested("-", "", 10_000),
        nested("not ", "", 5000),
        nested("1 + ", "", 5000),
        nested("abs(", ")", 5000),
        nested("{1: ", "}", 5000),
        nested("1 if 1 else ", "", 2000),
        nested("[a for a in ", "]", 2700),
        nested("[a for a in [1] if ", "]", 1500),
        format!("def f(x):\n    return {}{}", "[for in".repeat(4000), "]".repeat(4000)),
        format!("def f(x):\n    return [1{}]", " for a in x".repeat(2900)),
        format!("def f(x):\n    return {{1: 1{}}}", " if x".repeat(3000)),
        format!("def f(x):\n    return x{}", ".heading".repeat(3000)),
        format!("def f(x):\n    {}x = 1", "(".repeat(5000)),
        "#".repeat(40_000),
        (0..60).map(|n| format!("{}if 1:\n", " ".repeat(n))).collect(),
    ] {
        assert!(compile(&text).is_err(), "{}", &text[..40]);
    }
    let elifs = "    elif x: pass\n".repeat(1500);
    assert!(compile(&format!("def f(x):\n    if x: pass\n{elifs}")).is_ok());
}

#[test]
fn the_deepest_script_fits_the_stack_of_a_thread() {
    let blocks: String = (1..19).map(|n| format!("{}for b in [1]:\n", " ".repeat(n))).collect();
    let (open, close) = ("[".repeat(23), " for a in [1]]".repeat(23));
    let value = format!("{open}f(n - 1) if n else 0{close}");
    let text = format!("def f(n):\n{blocks}{}return {value}\n", " ".repeat(19));
    let text = format!("{text}def main():\n    return len(f(14))");
    // A thread has this much by default.
    let thread = std::thread::Builder::new().stack_size(2 << 20);
    let is_one = move || matches!(run(&text).unwrap(), Value::Int(1));
    assert!(thread.spawn(is_one).unwrap().join().unwrap());
}

#[test]
fn every_nan_is_the_same_key() {
    let entries = "n = math.inf - math.inf\n    d = {n: 1, abs(n): 2, -abs(n): 3}";
    let text = format!("def f():\n    {entries}\n    return len(d) == 1 and d[n] == 3");
    assert!(run(&text).unwrap().is_true());
}

#[test]
fn keys_of_returned_dicts_are_known_without_execution() {
    let keys = |body: &str| {
        let program = compile(&format!("def m(x):\n    {body}\n")).unwrap();
        program.returned_keys(FunctionId(0)).map(<[String]>::to_vec)
    };
    assert_eq!(keys("return {'a': 1, 'b': x}"), Some(vec!["a".into(), "b".into()]));
    let two = "if x:\n        return {'a': 1}\n    return {'b': 1, 'a': 2}";
    assert_eq!(keys(two), Some(vec!["a".into(), "b".into()]));
    assert_eq!(keys("return {x.heading: 1}"), None);
    assert_eq!(keys("d = {}\n    return d"), None);
}

#[test]
fn statements_on_one_line_and_attributes_work() {
    assert!(holds("pass; a = 1", "a == 1 and x.heading == 7 and x.neighbours(1) == None"));
}
