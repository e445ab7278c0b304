#!/usr/bin/env bash
# What some checks need besides Python, where it is missing: a browser, node, a counter of
# instructions, a model checker.
# `tests/install_tools.sh FOLDER` keeps those packages in FOLDER/node_modules.
set -euo pipefail
folder=$1

installed() { command -v "$1" >/dev/null; }

as_root=()
[[ $(id -u) == 0 ]] || as_root=(sudo)

missing=()
installed chromium || installed chromium-browser || installed google-chrome || missing+=(chromium)
installed node || missing+=(nodejs)
installed npm || missing+=(npm)
installed valgrind || [[ $(uname) != Linux ]] || missing+=(valgrind)
if ((${#missing[@]})); then
  if ! installed apt-get; then
    echo "please install: ${missing[*]}" >&2
    exit 1
  fi
  echo "Installing ${missing[*]} ..."
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" apt-get install -qy --no-install-recommends "${missing[@]}"
fi

if ! [[ -x $folder/node_modules/.bin/tsc && -d $folder/node_modules/@mcap/core ]]; then
  echo "Installing packages of node ..."
  npm install --silent --no-audit --no-fund --prefix "$folder" typescript@7.0.2 @mcap/core@2 fzstd@0.1
fi

# Without the model checker its tests are left out, which they say.
if ! { installed spin && installed cc; }; then
  echo "Installing spin ..."
  "${as_root[@]}" apt-get install -qy --no-install-recommends spin gcc libc6-dev \
    || echo "spin cannot be installed: the model of a drive will not be checked" >&2
fi
