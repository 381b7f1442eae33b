#!/bin/sh
# Creates an authority, and a certificate signed by it for the names and IP addresses under which
# other machines reach the coordinator. docker/compose.tls.yaml reads them. An existing authority
# stays, and the certificate is renewed.
set -eu
cd "$(dirname "$0")"

[ $# -gt 0 ] || { echo "usage: docker/make-certificates.sh NAME-OR-ADDRESS..." >&2; exit 2; }
command -v openssl >/dev/null || { echo "error: needs openssl, version 3" >&2; exit 1; }
names="DNS:coordinator,DNS:localhost,IP:127.0.0.1"
for name in "$@"; do
    case $name in
    "") echo "error: one of the names is empty" >&2; exit 2 ;;
    *[!0-9.]*) case $name in *:*) names="$names,IP:$name" ;; *) names="$names,DNS:$name" ;; esac ;;
    *) names="$names,IP:$name" ;;
    esac
done

# Only you can read the directory. Containers mount single files of it, which their user can read.
umask 077
mkdir -p secrets
for file in ca.pem coordinator.pem coordinator.key; do
    if [ -d "secrets/$file" ]; then rmdir "secrets/$file"; fi
done
cd secrets
new() { openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes "$@"; }
if [ ! -e ca.key ]; then
    new -days 3650 -keyout ca.key -out ca.pem -subj "/CN=swarm CA" 2>/dev/null
fi
new -days 365 -CA ca.pem -CAkey ca.key -keyout coordinator.key.new \
    -out coordinator.pem.new -subj "/CN=coordinator" \
    -addext "basicConstraints=critical,CA:FALSE" -addext "subjectAltName=$names"
chmod 444 ca.pem coordinator.key.new coordinator.pem.new
mv coordinator.key.new coordinator.key
mv coordinator.pem.new coordinator.pem
cd ..
grep -qs '^SWARM_CERTIFICATES=' .env || echo SWARM_CERTIFICATES=./secrets >> .env
echo "certificates for $names are in docker/secrets/; keep ca.key, it signs the next one"
