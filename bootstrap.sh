#!/bin/sh
# Prepares a machine that has Python 3.11 or newer; `make` calls it.
#
#   bootstrap.sh system PART...     installs missing system packages, or says which
#   bootstrap.sh venv FOLDER EXTRAS makes or completes the virtual environment
#
# PYTHON names the interpreter to use.
set -eu
cd "$(dirname "$0")"

find_python() {
    if [ -z "${PYTHON:-}" ]; then
        set -- python3 python3.14 python3.13 python3.12 python3.11
    else
        set -- "$PYTHON"
    fi
    for name; do
        if "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            command -v "$name"
            return
        fi
    done
    echo "None of these is a Python 3.11 or newer: $*. Install one, or name it: make PYTHON=..." >&2
    exit 1
}

# Debian's Python without its venv package has no ensurepip; a pip beside it will do instead.
make_venv() {
    if "$python" -c 'import ensurepip' 2>/dev/null; then
        "$python" -m venv --clear "$1"
    else
        "$python" -m venv --clear --without-pip "$1"
        "$python" -m pip --python "$1/bin/python" install --quiet pip
    fi
}

python=$(find_python)
case ${1:-} in
system)
    shift
    exec "$python" lfd_render/gpu/system.py "$@"
    ;;
venv)
    # An interrupted earlier try leaves an environment without pip.
    "$2/bin/python" -m pip --version >/dev/null 2>&1 || make_venv "$2"
    echo "Installing lfd-render$3 and what it needs into $2"
    "$2/bin/python" -m pip install --quiet --editable ".$3"
    ;;
*)
    sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
    exit 2
    ;;
esac
