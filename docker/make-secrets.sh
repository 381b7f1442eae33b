#!/bin/sh
# Makes the two tokens of a fleet, where docker/compose.yaml looks for them. What is
# there already stays as it is.
set -eu
cd "$(dirname "$0")"

command -v openssl >/dev/null || { echo "error: needs openssl, to draw random tokens" >&2; exit 1; }
# Nobody else can look into the directory; the containers' user, who gets single
# files of it, can read those.
umask 077
mkdir -p secrets
for token in client.token worker.token; do
    # A fleet that was started without them has left empty directories.
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
