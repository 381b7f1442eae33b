//! The protocol only grows: every promise to clients stays.
//!
//! `worker.proto` may change with its version: workers come from the same release as their
//! coordinator. Only the [`HANDSHAKE`] stays, so that a coordinator can refuse workers of another
//! version and say why.
//!
//! `swarm.v1.binpb` is the descriptor of the promised interface. Promise additions with
//!
//! ```sh
//! SWARM_PROMISE=1 cargo test -p swarm-proto --test compatibility
//! ```
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{collections::BTreeSet, env, fs};

use prost::Message as _;
use prost_types::{
    DescriptorProto, EnumDescriptorProto, FileDescriptorSet, ServiceDescriptorProto,
    field_descriptor_proto::{Label, Type},
};
use swarm_proto::FILE_DESCRIPTOR_SET;

const PROMISED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/swarm.v1.binpb");

fn present() -> FileDescriptorSet {
    let mut set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).unwrap();
    for file in &mut set.file {
        // Comments promise nothing.
        file.source_code_info = None;
    }
    set
}

fn promised() -> FileDescriptorSet {
    FileDescriptorSet::decode(&*fs::read(PROMISED).unwrap()).unwrap()
}

/// Everything that a client may rely on, one line each. Any change removes a line.
fn facts(set: &FileDescriptorSet) -> BTreeSet<String> {
    let mut facts = BTreeSet::new();
    for file in &set.file {
        let package = file.package();
        file.message_type.iter().for_each(|message| add_message(&mut facts, package, message));
        file.enum_type.iter().for_each(|enumeration| add_enum(&mut facts, package, enumeration));
        file.service.iter().for_each(|service| add_service(&mut facts, package, service));
    }
    facts
}

fn add_message(facts: &mut BTreeSet<String>, scope: &str, message: &DescriptorProto) {
    let scope = format!("{scope}.{}", message.name());
    facts.insert(format!("message {scope}"));
    for field in &message.field {
        let presence = match field.oneof_index {
            _ if field.proto3_optional() => "optional".to_owned(),
            Some(index) => format!("in oneof {}", message.oneof_decl[index as usize].name()),
            None => "plain".to_owned(),
        };
        facts.insert(format!(
            "field {scope}.{} = {}: {:?} {:?} {} {presence}, {} in JSON",
            field.name(),
            field.number(),
            field.label(),
            field.r#type(),
            field.type_name(),
            field.json_name(),
        ));
    }
    message.nested_type.iter().for_each(|nested| add_message(facts, &scope, nested));
    message.enum_type.iter().for_each(|enumeration| add_enum(facts, &scope, enumeration));
}

fn add_enum(facts: &mut BTreeSet<String>, scope: &str, enumeration: &EnumDescriptorProto) {
    let scope = format!("{scope}.{}", enumeration.name());
    facts.insert(format!("enum {scope}"));
    for value in &enumeration.value {
        facts.insert(format!("value {scope}.{} = {}", value.name(), value.number()));
    }
}

fn add_service(facts: &mut BTreeSet<String>, scope: &str, service: &ServiceDescriptorProto) {
    let scope = format!("{scope}.{}", service.name());
    facts.insert(format!("service {scope}"));
    for method in &service.method {
        let side = |is_stream, message| if is_stream { ("stream", message) } else { ("", message) };
        let takes = side(method.client_streaming(), method.input_type());
        let returns = side(method.server_streaming(), method.output_type());
        facts.insert(format!("method {scope}/{} {takes:?} {returns:?}", method.name()));
    }
}

/// Beginnings of the facts of `worker.proto` that hold for all its versions.
const HANDSHAKE: [&str; 5] = [
    "service swarm.v1.WorkerService",
    "method swarm.v1.WorkerService/Work ",
    "field swarm.v1.WorkRequest.hello ",
    "field swarm.v1.Hello.protocol_version ",
    "field swarm.v1.Hello.sim_core_fingerprint ",
];

/// The version that a `worker.proto` describes; `None` for files from before it had one.
fn worker_version(set: &FileDescriptorSet) -> Option<i32> {
    let mut enums = set.file.iter().flat_map(|file| &file.enum_type);
    let version = enums.find(|enumeration| enumeration.name() == "ProtocolVersion")?;
    let mut values = version.value.iter();
    Some(values.find(|value| value.name() == "PROTOCOL_VERSION_CURRENT")?.number())
}

/// The files of a set with this name, or without it.
fn files(set: &FileDescriptorSet, is_in: impl Fn(&str) -> bool) -> FileDescriptorSet {
    let file = set.file.iter().filter(|file| is_in(file.name())).cloned().collect();
    FileDescriptorSet { file }
}

/// Facts of the first protocol that the second lacks.
fn broken(promised: &FileDescriptorSet, present: &FileDescriptorSet) -> Vec<String> {
    let is_workers = |name: &str| name.ends_with("/worker.proto");
    let facts_of =
        |set| (facts(&files(set, |name| !is_workers(name))), facts(&files(set, is_workers)));
    let (promised_to_clients, mut promised_to_workers) = facts_of(promised);
    let (for_clients, for_workers) = facts_of(present);
    if worker_version(present) > worker_version(promised) {
        promised_to_workers.retain(|fact| HANDSHAKE.iter().any(|prefix| fact.starts_with(prefix)));
    }
    let lost_by_clients = promised_to_clients.difference(&for_clients);
    lost_by_clients.chain(promised_to_workers.difference(&for_workers)).cloned().collect()
}

#[test]
fn the_protocol_keeps_its_promises() {
    if env::var_os("SWARM_PROMISE").is_some() {
        let is_new = !fs::exists(PROMISED).unwrap();
        assert!(is_new || broken(&promised(), &present()).is_empty(), "a promise can only grow");
        fs::write(PROMISED, present().encode_to_vec()).unwrap();
    }
    let broken = broken(&promised(), &present());
    assert!(
        broken.is_empty(),
        "clients rely on the lines that are gone or changed; add new ones beside them, or, in \
         worker.proto, raise PROTOCOL_VERSION_CURRENT: {broken:#?}"
    );
}

/// The promises that `change` breaks in a protocol with an element of every kind.
fn broken_by(change: impl FnOnce(&mut FileDescriptorSet)) -> Vec<String> {
    let mut changed = present();
    change(&mut changed);
    broken(&present(), &changed)
}

fn message<'a>(set: &'a mut FileDescriptorSet, name: &str) -> &'a mut DescriptorProto {
    let mut messages = set.file.iter_mut().flat_map(|file| &mut file.message_type);
    messages.find(|message| message.name() == name).unwrap()
}

fn service<'a>(set: &'a mut FileDescriptorSet, name: &str) -> &'a mut ServiceDescriptorProto {
    let mut services = set.file.iter_mut().flat_map(|file| &mut file.service);
    services.find(|service| service.name() == name).unwrap()
}

fn states(set: &mut FileDescriptorSet) -> &mut EnumDescriptorProto {
    set.file.iter_mut().find_map(|file| file.enum_type.first_mut()).unwrap()
}

#[test]
fn every_kind_of_breaking_change_is_found_by_name() {
    type Change = fn(&mut FileDescriptorSet);
    let changes: [(&str, Change); 16] = [
        ("message swarm.v1.Notice", |set| message(set, "Notice").name = Some("Remark".into())),
        ("field swarm.v1.Notice.message", |set| message(set, "Notice").field.clear()),
        ("field swarm.v1.Notice.message", |set| {
            message(set, "Notice").field[0].name = Some("text".into());
        }),
        ("field swarm.v1.Notice.message", |set| {
            message(set, "Notice").field[0].json_name = Some("text".into());
        }),
        ("field swarm.v1.Notice.message", |set| message(set, "Notice").field[0].number = Some(2)),
        ("field swarm.v1.Notice.message", |set| {
            message(set, "Notice").field[0].set_type(Type::Bytes);
        }),
        ("field swarm.v1.Notice.message", |set| {
            message(set, "Notice").field[0].set_label(Label::Repeated);
        }),
        ("field swarm.v1.Notice.message", |set| {
            message(set, "Notice").field[0].proto3_optional = Some(true);
        }),
        ("field swarm.v1.ListWorkersResponse.workers", |set| {
            message(set, "ListWorkersResponse").field[0].type_name = Some(".swarm.v1.Event".into());
        }),
        ("field swarm.v1.Event.notice", |set| {
            let field =
                message(set, "Event").field.iter_mut().find(|field| field.name() == "notice");
            field.unwrap().oneof_index = None;
        }),
        ("enum swarm.v1.ExperimentState", |set| states(set).name = Some("State".into())),
        ("value swarm.v1.ExperimentState.EXPERIMENT_STATE_PAUSED", |set| {
            states(set).value.pop();
        }),
        ("value swarm.v1.ExperimentState.EXPERIMENT_STATE_RUNNING", |set| {
            states(set).value[1].number = Some(77);
        }),
        ("service swarm.v1.FleetService", |set| {
            service(set, "FleetService").name = Some("Fleet".into());
        }),
        ("method swarm.v1.FleetService/ListWorkers", |set| {
            service(set, "FleetService").method[0].server_streaming = Some(true);
        }),
        ("method swarm.v1.FleetService/ListWorkers", |set| {
            service(set, "FleetService").method[0].input_type = Some(".swarm.v1.Event".into());
        }),
    ];
    for (expected, change) in changes {
        let broken = broken_by(change);
        assert!(broken.iter().any(|fact| fact.starts_with(expected)), "{expected}: {broken:#?}");
    }
}

#[test]
fn additions_break_nothing() {
    let broken = broken_by(|set| {
        let mut field = message(set, "Notice").field[0].clone();
        (field.name, field.number) = (Some("level".into()), Some(2));
        message(set, "Notice").field.push(field);
        let mut value = states(set).value[1].clone();
        (value.name, value.number) = (Some("EXPERIMENT_STATE_QUEUED".into()), Some(78));
        states(set).value.push(value);
        let mut method = service(set, "FleetService").method[0].clone();
        method.name = Some("DrainWorker".into());
        service(set, "FleetService").method.push(method);
    });
    assert_eq!(broken, Vec::<String>::new());
}

fn raise_worker_version(set: &mut FileDescriptorSet) {
    let mut enums = set.file.iter_mut().flat_map(|file| &mut file.enum_type);
    let version = enums.find(|enumeration| enumeration.name() == "ProtocolVersion").unwrap();
    let current = version.value.iter_mut().find(|value| value.name() == "PROTOCOL_VERSION_CURRENT");
    *current.unwrap().number.as_mut().unwrap() += 1;
}

#[test]
fn messages_of_workers_change_with_their_version_and_the_handshake_never() {
    let change = |set: &mut FileDescriptorSet| message(set, "Assignment").field.clear();
    assert!(!broken_by(change).is_empty(), "without another version");
    let with_version = broken_by(|set| {
        change(set);
        raise_worker_version(set);
    });
    assert_eq!(with_version, Vec::<String>::new());
    let of_the_handshake = broken_by(|set| {
        raise_worker_version(set);
        message(set, "Hello").field[0].number = Some(77);
    });
    assert_eq!(of_the_handshake.len(), 1, "{of_the_handshake:?}");
    let of_clients = broken_by(|set| {
        raise_worker_version(set);
        message(set, "Notice").field.clear();
    });
    assert_eq!(of_clients.len(), 1, "{of_clients:?}");
}
