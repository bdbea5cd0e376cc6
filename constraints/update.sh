#!/bin/sh
# Pin every package, with hashes, for every platform and Python >= 3.11.  Needs uv.
# What is pinned stays as it is: `constraints/update.sh --upgrade` takes the newest of everything,
# `constraints/update.sh --upgrade-package NAME` of one.
set -eu
cd "$(dirname "$0")/.."
lock() {
    name=$1
    shift
    uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-emit-index-url \
        --no-emit-find-links --no-annotate "$@" pyproject.toml constraints/build.in -o "constraints/$name.txt"
    sed -i '1i # Made by constraints/update.sh' "constraints/$name.txt"
}
lock test --extra all --extra test --extra peers --extra cluster --extra logs "$@"
lock run --extra all -c constraints/test.txt
lock docs --extra all --extra docs -c constraints/test.txt "$@"
