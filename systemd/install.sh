#!/usr/bin/env bash
# Install flightd as a service on Debian, Ubuntu or Raspberry Pi OS (64 bit): program in /opt/flightd,
# configuration in /etc/flightd, state in /var/lib/flightd.  May be run again: it updates the program and
# keeps every configuration file that is there.
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: systemd/install.sh [--extras LIST] [--root DIR]
       systemd/install.sh --uninstall [--purge] [--root DIR]

  --extras LIST   optional parts, by commas, for example ardrone,xlsx; a wrong name tells them all
  --root DIR      install into the system below DIR (an image); nothing is started
  --uninstall     remove program, unit and rules; keep configuration, state and user
  --purge         with --uninstall: remove those, too
TEXT
}

fail() {
    echo "install.sh: $*" >&2
    exit 2
}

root='' extras='' uninstall=no purge=no
while [ $# -gt 0 ]; do
    case $1 in
        --root) [ -d "${2:-}" ] || fail "--root: give a folder that exists"; root=$(cd "$2" && pwd); shift ;;
        --extras) extras=${2:-}; [ -n "$extras" ] || fail "--extras: give a list, for example ardrone"; shift ;;
        --uninstall) uninstall=yes ;;
        --purge) purge=yes ;;
        -h | --help) usage; exit 0 ;;
        *) usage >&2; fail "unknown option $1" ;;
    esac
    shift
done
[ "$root" != / ] || root=''

source=$(cd "$(dirname "$0")/.." && pwd)

# The names under [project.optional-dependencies], but for what only a developer needs.
known_extras() {
    sed -n '/^\[project.optional-dependencies\]/,/^\[project.scripts\]/s/^\([a-z0-9-]*\) = .*/\1/p' \
        "$source/pyproject.toml" | grep -vx 'dev\|docs'
}

IFS=', ' read -ra wanted <<<"$extras"
for extra in "${wanted[@]}"; do
    known_extras | grep -qxF -- "$extra" ||
        fail "--extras $extra: unknown; choose among $(known_extras | paste -sd ' ' | sed 's/ /, /g')"
done
[ "$(id -u)" = 0 ] || fail "it writes to /opt, /etc and /var: run it with sudo"

program=/opt/flightd
unit=/etc/systemd/system/flightd.service
rules=/etc/udev/rules.d/99-flightd.rules
ground_unit=/etc/systemd/system/flightd-ground.service
deliver_unit=/etc/systemd/system/flightd-deliver.service
deliver_timer=/etc/systemd/system/flightd-deliver.timer
users=/etc/sysusers.d/flightd.conf

# Whether the system that is installed into is the one that runs.
running() { [ -z "$root" ] && [ -d /run/systemd/system ]; }

remove() {
    if running; then
        systemctl disable --now flightd.service flightd-ground.service flightd-deliver.timer 2>/dev/null || true
        systemctl stop flightd-deliver.service 2>/dev/null || true
    fi
    local folder=$root$program
    rm -rf "${folder:?}"
    rm -f "$root/usr/local/bin/flightd" "$root/usr/local/bin/flightctl"
    rm -f "$root$unit" "$root$ground_unit" "$root$deliver_unit" "$root$deliver_timer" "$root$rules" "$root$users"
    if [ "$purge" = yes ]; then
        rm -rf "$root/etc/flightd" "$root/var/lib/flightd" "$root/var/lib/flightd-ground"
        userdel ${root:+--prefix "$root"} flightd-ground 2>/dev/null || true
        userdel ${root:+--prefix "$root"} flightd 2>/dev/null || true
    fi
    if running; then
        systemctl daemon-reload
        udevadm control --reload
    fi
    echo "flightd is removed"
}

python() {
    local found
    # the system's own first: one in somebody's home is out of the daemon's reach
    for found in /usr/bin/python3 python3 python3.13 python3.12 python3.11; do
        if "$found" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            "$found" -c 'import ensurepip, venv' 2>/dev/null || fail "$found has no venv: apt install $found-venv"
            echo "$found"
            return
        fi
    done
    fail "flightd needs Python 3.11 or newer: apt install python3 python3-venv (Debian 12, Ubuntu 24.04 or newer)"
}

install_program() {
    local python what=$source
    python=$(python)
    [ -z "$extras" ] || what="${source}[$extras]"
    "$python" -m venv --clear "$root$program"
    "$root$program/bin/python" -m pip install --quiet --disable-pip-version-check \
        --constraint "$source/constraints.txt" --upgrade "$what" ||
        fail "the packages could not be installed: the lines above say why; run this again when it is mended"
    if [ -n "$root" ]; then # what pip wrote into the scripts holds in the installed system
        grep -rlI -- "$root$program" "$root$program/bin" "$root$program/pyvenv.cfg" |
            xargs -r sed -i "s|$root$program|$program|g"
    fi
    mkdir -p "$root/usr/local/bin"
    ln -sf "$program/bin/flightd" "$program/bin/flightctl" "$root/usr/local/bin/"
}

# keep MODE SOURCE TARGET: a configuration file that is there is the owner's.
keep() {
    if [ -e "$root$3" ]; then
        echo "kept $3"
    else
        install -D -m "$1" "$2" "$root$3"
        echo "wrote $3"
    fi
}

install_files() {
    install -D -m 644 "$source/systemd/flightd.service" "$root$unit"
    install -D -m 644 "$source/systemd/flightd-ground.service" "$root$ground_unit"
    install -D -m 644 "$source/systemd/flightd-deliver.service" "$root$deliver_unit"
    install -D -m 644 "$source/systemd/flightd-deliver.timer" "$root$deliver_timer"
    install -D -m 644 "$source/systemd/99-flightd.rules" "$root$rules"
    install -D -m 644 "$source/systemd/flightd.sysusers" "$root$users"
    systemd-sysusers ${root:+--root="$root"} "$root$users"
    keep 640 "$source/configs/ardupilot.toml" /etc/flightd/flightd.toml
    keep 640 "$source/configs/site-demo.toml" /etc/flightd/site-demo.toml
    keep 640 "$source/configs/sim.toml" /etc/flightd/sim.toml
    local scenario
    for scenario in "$source"/configs/scenarios/*.toml; do
        keep 640 "$scenario" "/etc/flightd/scenarios/${scenario##*/}"
    done
    install -d -m 750 "$root/etc/flightd" "$root/var/lib/flightd"
    local owner
    owner=$(sed -n 's/^flightd:[^:]*:\([0-9]*\):\([0-9]*\):.*/\1:\2/p' "$root/etc/passwd")
    [ -n "$owner" ] || fail "the user flightd was not made"
    chown -R "0:${owner#*:}" "$root/etc/flightd"
    chown "$owner" "$root/var/lib/flightd"
    if [ -z "$root" ] && ! runuser -u flightd -- "$program/bin/flightd" --version >/dev/null; then
        fail "user flightd cannot run $program/bin/flightd: its Python, $(readlink -f "$program/bin/python"), must be for all"
    fi
}

if [ "$uninstall" = yes ]; then
    remove
    exit 0
fi
[ "$purge" = no ] || fail "--purge belongs to --uninstall"
if running && systemctl is-active --quiet flightd.service; then
    fail "flightd runs: put the drone on its pad, then 'systemctl stop flightd', then this again"
fi
if running && systemctl is-active --quiet flightd-ground.service; then
    fail "the ground station runs: land what it watches, then 'systemctl stop flightd-ground', then this again"
fi
install_program
install_files
if running; then
    systemctl daemon-reload
    udevadm control --reload && udevadm trigger --subsystem-match=video4linux --subsystem-match=tty
fi
cat <<TEXT
flightd is installed.  Next:
  edit /etc/flightd/flightd.toml and your site file beside it
  sudo -u flightd flightd doctor --config /etc/flightd/flightd.toml     (propellers off)
  sudo systemctl enable --now flightd
A ground station (installed with --extras ground): see "As a ground station" in flightd guide service.
TEXT
