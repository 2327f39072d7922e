# Sourced: make_venv EXTRA builds .venv with flightd[EXTRA] from the pinned constraints, once.

make_venv() {
    local extra=$1 python stamp
    for python in python3 python3.13 python3.12 python3.11 none; do
        "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && break
    done
    [ "$python" != none ] || {
        echo "flightd needs Python 3.11 or newer: sudo apt install python3.11 python3.11-venv" >&2
        exit 2
    }
    "$python" -c 'import ensurepip, venv' 2>/dev/null || {
        echo "Python's venv module is missing: sudo apt install $python-venv" >&2
        exit 2
    }
    stamp=.venv/installed-$extra-$(cat pyproject.toml constraints.txt | cksum | cut -d' ' -f1)
    [ -e "$stamp" ] && return
    [ -x .venv/bin/python ] || "$python" -m venv .venv
    echo "== installing flightd[$extra] into .venv"
    # Only what is imported is worth compiling, and that happens as it is imported.
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile \
        --constraint constraints.txt --editable ".[$extra]" || {
        echo "installing failed: the lines above say why (no network? no space?); run this again when it is mended" >&2
        exit 2
    }
    touch "$stamp"
}
