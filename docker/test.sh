#!/usr/bin/env bash
# Builds the images, brings a fleet up on a real engine, kills parts of it, and compares digests.
# Without an engine, it prints that it is skipped.
#
# If no registry is reachable, it makes stand-ins for the base images from Debian packages and this
# machine's Rust, and keeps them for the next time. It always removes everything else, except the
# layers of the build with KEEP_BUILD=1.
set -euo pipefail
cd "$(dirname "$0")/.."

# Long enough for the kills to land in the middle.
GENERATIONS=800

step() { printf '\n-- %s\n' "$*"; }
# .ci/run looks for these two beginnings: this machine cannot run the test, or could after an
# installation.
skip() { printf 'SKIPPED: the fleet of containers is not tested: %s\n' "$*"; exit 0; }
skip_installable() {
    printf 'SKIPPED, but can be installed: the fleet of containers is not tested: %s\n' "$*"
    exit 0
}
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }

# Repeats a command until it succeeds: wait_for WHAT COMMAND...
wait_for() {
    local what=$1 deadline=$((SECONDS + 600))
    shift
    until "$@"; do
        ((SECONDS < deadline)) || fail "$what did not come within 600 s"
        sleep 0.5
    done
}

# Runs a command that must fail with a code (or one of several: 1|15), in one line
# that matches: expect CODE PATTERN COMMAND...
expect() {
    local code=$1 pattern=$2 output actual=0
    shift 2
    output=$("$@" 2>&1 </dev/null) || actual=$?
    # Drops the lines that the compose tool adds: the names of what it creates, and the exit code.
    output=$(grep -Ev '^ *(Creating|Starting|Container|Network|Volume) |^[0-9]+$' <<< "$output" || true)
    [[ $actual =~ ^($code)$ ]] || fail "exit code $actual, not $code, of: $* ($output)"
    grep -q -- "$pattern" <<< "$output" || fail "no \"$pattern\" in: $output"
    (($(wc -l <<< "$output") == 1)) || fail "more than one line: $output"
    printf '%s: %s\n' "$actual" "$output"
}

# Installs a Debian package if a program is missing and that is possible.
need() {
    command -v "$1" >/dev/null && return
    [[ $EUID == 0 ]] && command -v apt-get >/dev/null || return
    local wait
    # Registries sometimes fail for a moment.
    for wait in 0 10 30; do
        sleep "$wait"
        apt-get update -qq && apt-get install -qq --no-install-recommends "$2" >/dev/null && break
    done
    command -v "$1" >/dev/null
}

choose_compose() {
    if docker compose version >/dev/null 2>&1; then
        compose=(docker compose)
    elif need docker-compose docker-compose; then
        compose=(docker-compose)
    else
        skip_installable "there is neither docker compose nor docker-compose"
    fi
    step "${compose[*]} $("${compose[@]}" version --short), engine $(docker version -f '{{.Server.Version}}')"
}

has_image() { docker image inspect "$1" >/dev/null 2>&1; }

choose_base_images() {
    export BUILD_IMAGE=rust:1.95-slim-bookworm RUNTIME_IMAGE=debian:bookworm-slim
    local image missing=0
    for image in $BUILD_IMAGE $RUNTIME_IMAGE; do
        has_image "$image" || timeout 300 docker pull -q "$image" || missing=1
    done
    ((missing)) || return 0
    step "no registry: stand-ins for the base images"
    need debootstrap debootstrap || skip_installable "there are no base images, and no debootstrap to make some"
    local cargo_version
    cargo_version=$(cargo --version | cut -d' ' -f2)
    RUNTIME_IMAGE=swarmevo-stand-in/debian:bookworm-slim
    BUILD_IMAGE=swarmevo-stand-in/rust:$cargo_version
    has_image $RUNTIME_IMAGE || make_debian
    has_image "$BUILD_IMAGE" || make_rust
}

make_debian() {
    debootstrap --variant=minbase bookworm "$work/debian" >"$work/debootstrap.log" \
        || { tail "$work/debootstrap.log"; fail "debootstrap"; }
    tar -C "$work/debian" -c . | docker import - $RUNTIME_IMAGE >/dev/null
    rm -rf "$work/debian"
}

# This machine's Rust, and how it reaches the registry of crates.
make_rust() {
    local context=$work/rust sysroot variable
    sysroot=$(rustc --print sysroot)
    mkdir -p "$context/usr/bin" "$context/cargo"
    cp "$sysroot"/bin/{cargo,rustc} "$context/usr/bin/"
    cp -r "$sysroot/lib" "$context/usr/"
    cp "${CARGO_HOME:-$HOME/.cargo}"/config.toml "$context/cargo/" 2>/dev/null || true
    cp -L "${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}" "$context/authorities.crt"
    {
        echo "FROM $RUNTIME_IMAGE"
        for variable in http_proxy https_proxy no_proxy; do
            [[ -z ${!variable:-} ]] || echo "ENV $variable=${!variable}"
        done
        echo "RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev"
        echo "COPY usr /usr/local"
        echo "COPY cargo /cargo"
        echo "COPY authorities.crt /authorities.crt"
        echo "ENV CARGO_HOME=/cargo CARGO_HTTP_CAINFO=/authorities.crt"
    } > "$context/Dockerfile"
    docker build --network host -t "$BUILD_IMAGE" "$context" > "$work/rust.log" \
        || { tail "$work/rust.log"; fail "the stand-in for the rust image"; }
    rm -rf "$context"
}

# The compose tool on this test's project: fleet [ARGUMENT...]
fleet() { "${compose[@]}" -p "$project" -f docker/compose.yaml "${overlays[@]}" "$@"; }
# swarmctl in its container.
swarmctl() { fleet run --rm -T swarmctl "$@" </dev/null; }
# The first container of a service. `head` would stop reading, and so break the pipe.
container() { fleet ps -q "$1" | sed -n 1p; }
is_healthy() { [[ $(docker inspect -f '{{.State.Health.Status}}' "$1") == healthy ]]; }
n_workers() { swarmctl workers --output csv 2>/dev/null | tail -n +2 | wc -l; }
has_workers() { [[ $(n_workers) == "$1" ]]; }
# The last generation in a coordinator's log: generation CONTAINER
generation() { docker logs "$1" 2>&1 | grep -o ' generation=[0-9]*' | tail -n 1 | cut -d= -f2; }
has_come_to() { local n; n=$(generation "$2"); ((${n:-0} >= $1)); }
last_digest() { grep -o '"digest": *"[0-9a-f]*"' | tail -n 1 | cut -d'"' -f4; }
restarts() { docker inspect -f '{{.RestartCount}}' "$1"; }
has_restarted() { (($(restarts "$1") > 0)) && [[ $(docker inspect -f '{{.State.Running}}' "$1") == true ]]; }

# Kills the process itself, as a crash does. After `docker kill`, the engine would not restart the
# container.
crash() {
    local pid
    pid=$(docker inspect -f '{{.State.Pid}}' "$1")
    if kill -9 "$pid" 2>/dev/null; then
        wait_for "the restart of a crashed container" has_restarted "$1"
    else
        docker kill "$1" >/dev/null
        docker start "$1" >/dev/null
    fi
}

cleanup() {
    local code=$?
    # The compose tool removes nothing unless these variables are set.
    export SWARM_SECRETS=${SWARM_SECRETS:-none} SWARM_CERTIFICATES=${SWARM_CERTIFICATES:-none}
    ((code == 0)) || { fleet ps; fleet logs --tail 20; } 2>&1 || true
    for project in "$work_name" "$work_name-away"; do
        fleet down -v --rmi local --remove-orphans -t 5 >/dev/null 2>&1 || true
    done
    [[ -n ${KEEP_BUILD:-} ]] || docker image prune -f --filter label=swarmevo.stage >/dev/null || true
    rm -rf "$work"
    exit $code
}

test_start_without_secrets() {
    step "a start without secrets says what to do"
    SWARM_SECRETS='' expect '1|15' 'run docker/make-secrets.sh first' fleet up
    "$work/docker/make-secrets.sh"
    export SWARM_SECRETS=$work/docker/secrets
}

test_build() {
    step "the images"
    fleet build > "$work/build.log" 2>&1 || { tail -n 40 "$work/build.log"; fail "the build"; }
    fleet --profile tools build swarmctl >> "$work/build.log" 2>&1 \
        || { tail -n 40 "$work/build.log"; fail "the build of swarmctl"; }
    docker images --format '{{.Repository}} {{.Size}}' | grep "^$project"
}

test_bad_input() {
    step "bad input is one line and an exit code"
    expect 4 'cannot reach a coordinator' swarmctl list
    expect 2 'token file /absent' swarmctl --token-file /absent list
    mkdir "$work/unwritable"
    expect 2 '/unwritable' fleet run --rm -T --no-deps -v "$work/unwritable:/unwritable" \
        -e SWARM_DATA_DIR=/unwritable coordinator
    expect 2 'without tokens' docker run --rm "$(docker images -q "$project*coordinator")"
}

test_kills() {
    step "up with two workers; kills in the middle of $GENERATIONS generations"
    fleet up -d --scale worker=2
    local coordinator worker id seen
    coordinator=$(container coordinator) worker=$(container worker)
    wait_for "the coordinator's health" is_healthy "$coordinator"
    wait_for "a worker's health" is_healthy "$worker"
    wait_for "two workers" has_workers 2
    id=$(swarmctl submit configs/experiment.json --output json | grep -o '"id": *[0-9]*' | grep -o '[0-9]*$')
    wait_for "some generations" has_come_to 10 "$coordinator"
    crash "$worker"
    seen=$(generation "$coordinator")
    echo "worker crashed; generation $seen"
    wait_for "more generations" has_come_to $((seen + 10)) "$coordinator"
    crash "$coordinator"
    seen=$(generation "$coordinator")
    echo "coordinator crashed; generation $seen"
    wait_for "more generations" has_come_to $((seen + 10)) "$coordinator"
    docker kill "$coordinator" >/dev/null
    seen=$(generation "$coordinator")
    ((seen < GENERATIONS - 1)) || fail "the run ended before the coordinator was killed"
    fleet up -d --scale worker=3
    echo "coordinator killed after generation $seen, and up again with three workers"
    wait_for "three workers" has_workers 3
    digest=$(swarmctl watch "$id" --output json | last_digest)
    docker logs "$coordinator" 2>&1 | tail -n 3
    [[ $digest == "$expected" ]] || fail "digest $digest, not $expected"
    echo "digest $digest, as without kills"
    fleet up -d --scale worker=1
    wait_for "one worker" has_workers 1
}

test_refusals_and_stop() {
    step "tokens, health checks, graceful stop"
    printf '%032d\n' 0 > "$work/wrong.token"
    chmod 444 "$work/wrong.token"
    expect 7 'not the coordinator.s client token' \
        fleet run --rm -T -v "$work/wrong.token:/wrong.token:ro" swarmctl --token-file /wrong.token list
    local coordinator worker
    coordinator=$(container coordinator) worker=$(container worker)
    docker exec "$coordinator" coordinator --health-check
    docker exec "$worker" worker --health-check
    fleet stop coordinator
    wait_for "the worker to notice" bash -c "! docker exec $worker worker --health-check 2>/dev/null"
    expect 1 'no session' docker exec "$worker" worker --health-check
    fleet stop
    for container in "$coordinator" "$worker"; do
        [[ $(docker inspect -f '{{.State.ExitCode}}' "$container") == 0 ]] || fail "no graceful stop"
    done
    fleet down -v
}

test_tls() {
    step "TLS, and a worker on what might be another machine"
    local address port
    overlays+=(-f docker/compose.tls.yaml)
    SWARM_CERTIFICATES='' expect '1|15' 'run docker/make-certificates.sh first' fleet up
    address=$(hostname -I | cut -d' ' -f1)
    "$work/docker/make-certificates.sh" "$address"
    export SWARM_CERTIFICATES=$work/docker/secrets
    fleet up -d --scale worker=0
    wait_for "the coordinator's health" is_healthy "$(container coordinator)"
    port=$(docker inspect -f '{{range $p, $b := .NetworkSettings.Ports}}{{range $b}}{{.HostIp}}:{{.HostPort}} {{end}}{{end}}' \
        "$(container coordinator)" | tr ' ' '\n' | sed -n 's/^0\.0\.0\.0://p')
    project=$work_name-away
    SWARM_COORDINATOR=https://$address:$port fleet up -d --no-deps --scale worker=1 worker
    project=$work_name
    wait_for "the worker from elsewhere" has_workers 1
    swarmctl submit configs/short.json --watch | tail -n 3
    expect 2 'is without TLS' swarmctl --coordinator http://coordinator:7700 list
    expect 8 'is for another name' swarmctl --tls-domain elsewhere list
}

docker info >/dev/null 2>&1 || skip "there is no docker engine"
work=$(mktemp -d)
chmod 755 "$work"
work_name=swarmevo-test-$$
project=$work_name
overlays=()
compose=(docker-compose)
trap cleanup EXIT
choose_compose
choose_base_images

# Takes free ports, and a profile that builds fast: an optimised build takes three times as long,
# and everything else in the images is the same.
export SWARM_PORT=0 SWARM_TLS_PORT=0 PROFILE=${PROFILE:-dev} WORKER_CPUS=1
mkdir "$work/docker" "$work/configs"
cp docker/make-*.sh "$work/docker/"
sed "s/\"generations\": 60/\"generations\": $GENERATIONS/" configs/quickstart.json > "$work/configs/experiment.json"
sed "s/\"generations\": 60/\"generations\": 5/" configs/quickstart.json > "$work/configs/short.json"
chmod -R go+rX "$work/configs"
export SWARM_CONFIGS=$work/configs
if [[ $BUILD_IMAGE == swarmevo-stand-in/* ]]; then
    # Stand-ins build with this machine's network.
    for service in coordinator worker swarmctl; do
        printf '%s: {build: {network: host}}\n' $service
    done | sed '1i services:' | sed '2,$s/^/  /' > "$work/network.yaml"
    overlays=(-f "$work/network.yaml")
fi

test_start_without_secrets
test_build
test_bad_input
step "the expected digest"
expected=$(swarmctl run configs/experiment.json --data-dir /tmp/data --output json 2>"$work/run.log" | last_digest)
[[ -n $expected ]] || fail "no digest: $(tail -n 3 "$work/run.log")"
echo "$expected"
test_kills
test_refusals_and_stop
test_tls
step "passed in $SECONDS s"
