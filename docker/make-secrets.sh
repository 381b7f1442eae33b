#!/bin/sh
# Creates the two tokens of a fleet, which docker/compose.yaml reads. Existing ones stay.
set -eu
cd "$(dirname "$0")"

command -v openssl >/dev/null || { echo "error: needs openssl, to draw random tokens" >&2; exit 1; }
# Only you can read the directory. Containers mount single files of it, which their user can read.
umask 077
mkdir -p secrets
for token in client.token worker.token; do
    # Docker creates empty directories in place of missing files.
    if [ -d "secrets/$token" ]; then rmdir "secrets/$token"; fi
    if [ ! -e "secrets/$token" ]; then
        openssl rand -hex 32 > "secrets/$token.new"
        chmod 444 "secrets/$token.new"
        mv "secrets/$token.new" "secrets/$token"
    fi
done
for line in COMPOSE_PROJECT_NAME=swarmevo SWARM_SECRETS=./secrets; do
    grep -qs "^${line%%=*}=" .env || echo "$line" >> .env
done
echo "tokens are in docker/secrets/, settings in docker/.env"
