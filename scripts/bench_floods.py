#!/usr/bin/env python3
"""Measures renders while unknown peers flood the master's port, on one machine and over loopback.

Each round renders the same frames undisturbed and under each attack, in turn, so that a change of the machine's load
concerns all of them. Reported per attack: frames that are there, whether their bytes equal those of the first
undisturbed run, the 95th percentile of the frame times in proportion to the undisturbed runs, the largest resident
memory of the master, and the time to join as a worker while the attack lasts (plain connections only).

The attackers share the processor with the farm: the proportions contain their own load.
"""

import argparse
import csv
import hashlib
import pathlib
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

MAGIC = b"RAYFARM\n"
ROLE_WORKER = 2
KIND_HELLO, KIND_PONG = 0x01, 0x31
CONNECTIONS = 1000
JOIN_ATTEMPTS = 20


def text(value):
    data = value.encode()
    return struct.pack("<Q", len(data)) + data


def hello(version, name):
    """Preamble and hello of a plain worker."""
    body = text(name) + struct.pack("<I", 1) + text("none") + text("0") + struct.pack("<Q", 0)
    preamble = MAGIC + struct.pack("<HBB", version, ROLE_WORKER, 0)
    return preamble + struct.pack("<IBBH", len(body), KIND_HELLO, 0, 0) + body


def connect(port):
    stream = socket.create_connection(("127.0.0.1", port), timeout=5)
    stream.settimeout(5)
    return stream


def receive(stream, count):
    data = b""
    while len(data) < count:
        more = stream.recv(count - len(data))
        if not more:
            raise ConnectionError("closed")
        data += more
    return data


def join(port, version, name):
    """Joins as a plain worker. Returns the connection after the master's answer."""
    stream = connect(port)
    stream.sendall(hello(version, name))
    receive(stream, 12)
    length = struct.unpack("<I", receive(stream, 8)[:4])[0]
    receive(stream, length)
    return stream


def half_open(port, _version, stop):
    """Connections that send nothing; closed ones are opened again."""
    hold(port, stop, lambda stream: None)


def slow(port, _version, stop):
    """Connections that send a byte of the preamble every half second."""

    def step(stream, position=[0]):
        position[0] += 1
        stream.sendall(MAGIC[position[0] % 8 : position[0] % 8 + 1])

    hold(port, stop, step)


def hold(port, stop, step):
    streams = []
    while not stop.is_set():
        while len(streams) < CONNECTIONS and not stop.is_set():
            try:
                streams.append(connect(port))
            except OSError:
                break
        alive = []
        for stream in streams:
            try:
                step(stream)
                stream.setblocking(False)
                try:
                    if stream.recv(64) == b"":
                        raise ConnectionError("closed")
                except BlockingIOError:
                    pass
                alive.append(stream)
            except OSError:
                stream.close()
        streams = alive
        stop.wait(0.5)
    for stream in streams:
        stream.close()


def hellos(port, version, stop):
    """Joins and leaves as fast as one thread can."""
    count = 0
    while not stop.is_set():
        count += 1
        try:
            join(port, version, f"flood-{count}").close()
        except OSError:
            stop.wait(0.01)


def pongs(port, version, stop):
    """A worker that sends pongs without pings, again after each end of its session."""
    pong = struct.pack("<IBBH", 9, KIND_PONG, 0, 0) + struct.pack("<QB", 1 << 63, 0)
    while not stop.is_set():
        try:
            stream = join(port, version, "pongs")
            while not stop.is_set():
                stream.sendall(pong * 1000)
        except OSError:
            stop.wait(0.01)


ATTACKS = {"half-open": half_open, "slow": slow, "hellos": hellos, "pongs": pongs}


def free_port():
    with socket.socket() as stream:
        stream.bind(("127.0.0.1", 0))
        return stream.getsockname()[1]


def peak_memory(pid):
    """Largest resident memory of a process so far, in MiB; 0 where it is not known."""
    try:
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0.0
    lines = [line for line in status.splitlines() if line.startswith("VmHWM:")]
    return int(lines[0].split()[1]) / 1024 if lines else 0.0


def join_times(port, version, stop, times):
    while not stop.is_set() and len(times) < JOIN_ATTEMPTS:
        begun = time.perf_counter()
        try:
            join(port, version, "measured").close()
            times.append((time.perf_counter() - begun) * 1000)
        except OSError:
            pass
        stop.wait(0.1)


def render(args, attack, folder):
    """Renders the frames, with an attack or without. Returns the measurements."""
    port, log = free_port(), folder / "log.csv"
    command = [args.master, "render", args.scene, "-o", folder / "frame-%04d.ppm", "--frames", args.frames]
    command += ["--spin", "1", "--size", args.size, "--listen", f"127.0.0.1:{port}", "--fps-log", log]
    process = subprocess.Popen([str(part) for part in command], stderr=subprocess.PIPE, text=True)
    errors = []
    reader = threading.Thread(target=lambda: errors.append(process.stderr.read()))
    reader.start()
    while process.poll() is None:
        try:
            connect(port).close()
            break
        except OSError:
            time.sleep(0.01)
    stop, times = threading.Event(), []
    threads = [threading.Thread(target=join_times, args=(port, args.version, stop, times))]
    flooder = None
    if attack:
        # A process of its own, so that Python's lock does not slow the measurement of joins.
        own = [sys.executable, __file__, "--attack", attack, "--port", str(port), "--version", str(args.version)]
        flooder = subprocess.Popen(own)
    for thread in threads:
        thread.start()
    memory = 0.0
    while process.poll() is None:
        memory = max(memory, peak_memory(process.pid))
        time.sleep(0.02)
    stop.set()
    if flooder:
        flooder.kill()
        flooder.wait()
    for thread in threads:
        thread.join()
    reader.join()
    if process.returncode != 0:
        sys.exit(f"the render ends with {process.returncode}:\n{errors[0]}")
    frames = sorted(folder.glob("frame-*.ppm"))
    digest = hashlib.sha256(b"".join(frame.read_bytes() for frame in frames)).hexdigest()
    with log.open() as lines:
        milliseconds = sorted(float(row["ms"]) for row in csv.DictReader(lines))
    p95 = milliseconds[int(0.95 * (len(milliseconds) - 1))]
    return {"frames": len(frames), "digest": digest, "p95": p95, "memory": memory, "joins": times}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--master", default="target/release/rayfarm-master")
    parser.add_argument("--scene", default="models/room.toml")
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--version", type=int, default=7, help="protocol version of the master")
    parser.add_argument("--attack", choices=ATTACKS, help=argparse.SUPPRESS)
    parser.add_argument("--port", type=int, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.attack:
        return ATTACKS[args.attack](args.port, args.version, threading.Event())
    results = {name: [] for name in [None, *ATTACKS]}
    for number in range(args.rounds):
        for attack in results:
            with tempfile.TemporaryDirectory() as folder:
                results[attack].append(render(args, attack, pathlib.Path(folder)))
            print(f"round {number + 1} of {args.rounds}: {attack or 'undisturbed'}", file=sys.stderr)
    undisturbed = results[None]
    base = statistics.median(run["p95"] for run in undisturbed)
    print(f"{'attack':<12} {'frames':>6} {'bytes':>9} {'p95 ms':>8} {'ratio':>6} {'MiB':>7} {'join ms':>8}")
    for attack, runs in results.items():
        p95 = statistics.median(run["p95"] for run in runs)
        same = all(run["digest"] == undisturbed[0]["digest"] for run in runs)
        joins = [time for run in runs for time in run["joins"]]
        joined = f"{statistics.median(joins):8.1f}" if joins else "       -"
        memory = max(run["memory"] for run in runs)
        fewest = min(run["frames"] for run in runs)
        print(
            f"{attack or 'undisturbed':<12} {fewest:>6} {'same' if same else 'DIFFERENT':>9} {p95:8.2f} "
            f"{p95 / base:6.2f} {memory:7.1f} {joined}"
        )


if __name__ == "__main__":
    # More connections than the usual limit of open files.
    try:
        import resource

        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    except (ImportError, ValueError, OSError):
        pass
    sys.exit(main())
