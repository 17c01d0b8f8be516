"""Replays recorded member times in simulated runs on many ranks, by the rule of src/monte_carlo/sg_scheduler.f90, and
says how much of the ranks' time computes members and where the rest goes.

Usage: schedule.py ENSEMBLE.h5|--spread SHORTEST [--ranks 64 1024 16384] [--per-rank 1 10 100] [--sync-ms 0.3] ...

The rule: one pool in a fixed order; every rank computes, rank 0 too, which serves the others from inside its own
members (every 5 ms, up to 1000 messages, then one sync of the journal unless that takes over 5 % of the time); the
others hold a task in advance until less than one task a rank is left. Costs of rank 0 are those that bench_scheduler
prints. Members are drawn with replacement from the recorded column `seconds`. With --spread 0.1 instead of a file they
are those of bench_scheduler, which runs the real scheduler: the two should agree.
"""

import argparse
import collections
import heapq
from dataclasses import asdict, dataclass
from pathlib import Path

import h5py
import numpy as np

LOOK_EVERY, REST, MESSAGES_PER_LOOK = 0.005, 0.0005, 1000
SYNC_SHARE = 0.05


@dataclass(frozen=True)
class Costs:
    """In s. `message`: rank 0 takes in a row, gives a task and keeps the row; `task`: it gives a task; `sync`: of the
    journal; `latency`: of a message; `startup`: before the first task; `write`: of ensemble.h5, every `write_every`."""

    message: float
    task: float
    sync: float
    latency: float
    startup: float
    write: float
    write_every: float


class Run:
    """One simulated run. Times count from the first task; the start-up comes on top."""

    def __init__(self, times, ranks, costs):
        self.times, self.ranks, self.costs = times, ranks, costs
        self.next = 0
        self.queues = [collections.deque() for _ in range(ranks)]
        self.held = [0] * ranks
        self.idle_since = [0.0] * ranks
        self.waited = 0.0
        self.results = []
        self.now = 0.0
        self.busy_serving = 0.0
        self.last_sync, self.has_unsynced = 0.0, False

    def give(self, worker):
        """Fills up the tasks of a worker, as `give` of the scheduler does."""
        while self.held[worker] < 2 and self.next < len(self.times):
            if self.held[worker] == 1 and len(self.times) - self.next - 1 < self.ranks:
                return
            self.held[worker] += 1
            self.queues[worker].append((self.now + self.costs.latency, self.times[self.next]))
            self.next += 1
            if self.idle_since[worker] is not None:
                self.start(worker, self.idle_since[worker])

    def start(self, worker, free_at):
        """The worker, free since then, begins its next task, or has none."""
        if not self.queues[worker]:
            self.idle_since[worker] = free_at
            return
        self.idle_since[worker] = None
        arrival, length = self.queues[worker].popleft()
        begin = max(arrival, free_at)
        self.waited += begin - free_at
        heapq.heappush(self.results, (begin + length + self.costs.latency, worker))

    def serve(self):
        """Rank 0 looks: handles the results that are there, then syncs."""
        begin = self.now
        for _ in range(MESSAGES_PER_LOOK):
            if not self.results or self.results[0][0] > self.now:
                break
            arrival, worker = heapq.heappop(self.results)
            self.held[worker] -= 1
            # What it began meanwhile is no news; its next result is.
            self.start(worker, arrival - self.costs.latency)
            self.now += self.costs.message
            self.give(worker)
        self.has_unsynced = self.has_unsynced or self.now > begin
        if self.has_unsynced and self.now - self.last_sync >= self.costs.sync / SYNC_SHARE:
            self.now += self.costs.sync
            self.last_sync, self.has_unsynced = self.now, False
        if self.now >= self.next_write:
            self.now += self.costs.write
            self.next_write = self.now + self.costs.write_every
        self.busy_serving += self.now - begin

    def simulate(self):
        """Efficiency and the shares of what is lost: start-up, waiting for tasks, service of rank 0, tail."""
        self.next_write = self.costs.write_every
        for worker in range(1, self.ranks):
            self.give(worker)
            self.now += self.held[worker] * self.costs.task
        first = self.now
        while self.next < len(self.times):
            left = self.times[self.next]
            self.next += 1
            while left > 0:
                self.now += min(left, LOOK_EVERY)
                left -= LOOK_EVERY
                self.serve()
        own_end = self.now
        served_by_then = self.busy_serving
        while self.results:
            self.now = max(self.now + REST, self.results[0][0])
            self.serve()
        wall = self.now + self.costs.startup
        total = wall * self.ranks
        tail = sum(self.now - since for since in self.idle_since[1:]) + self.now - own_end
        # Waits before the first task are the start of the run.
        return {
            "efficiency": self.times.sum() / total,
            "start": self.costs.startup / wall,
            "waiting": self.waited / total,
            "rank 0": (served_by_then + first) / total,
            "tail": tail / total,
            "wall": wall,
        }


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ensemble", type=Path, nargs="?")
    parser.add_argument("--spread", type=float, help="members of 1 to 5 times so many seconds")
    parser.add_argument("--ranks", type=int, nargs="+", default=[64, 1024, 16384])
    parser.add_argument("--per-rank", type=float, nargs="+", default=[1, 10, 100], help="members for each rank")
    parser.add_argument("--members", type=int, nargs="*", default=[], help="totals beside those")
    parser.add_argument("--message-us", type=float, default=20.0)
    parser.add_argument("--task-us", type=float, default=2.0)
    parser.add_argument("--sync-ms", type=float, default=0.3)
    parser.add_argument("--latency-us", type=float, default=10.0)
    parser.add_argument("--startup-s", type=float, default=1.0)
    parser.add_argument("--write-s", type=float, default=0.1)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if not options.ensemble and not options.spread:
        parser.error("an ensemble.h5 or --spread")
    return options


def spread(shortest, number):
    """Times of the members of tests/bench/sleeping_members.f90."""
    share = np.arange(1, number + 1) * 0.618033988749895 % 1.0 * 4093.0 % 1.0
    return shortest * (1.0 + 4.0 * share)


def recorded(path):
    """Times of all members of a file, in s."""
    with h5py.File(path) as file:
        return np.concatenate([group["seconds"][:] for group in file["cases"].values()])


def main():
    """Prints a table."""
    options = arguments()
    times = recorded(options.ensemble) if options.ensemble else spread(options.spread, 1000)
    costs = Costs(
        message=options.message_us * 1e-6,
        task=options.task_us * 1e-6,
        sync=options.sync_ms * 1e-3,
        latency=options.latency_us * 1e-6,
        startup=options.startup_s,
        write=options.write_s,
        write_every=max(30.0, options.write_s / 0.02),
    )
    print(f"{len(times)} members of {times.min():.2f} to {times.max():.2f} s, mean {times.mean():.2f} s")
    print(", ".join(f"{name} {value:.3g} s" for name, value in asdict(costs).items()))
    print("| ranks | members | wall, s | efficiency | start-up | waiting for tasks | rank 0 serving | tail |")
    print("|---|---|---|---|---|---|---|---|")
    for ranks in options.ranks:
        for members in [*(round(ranks * n) for n in options.per_rank), *options.members]:
            drawn = np.random.default_rng(options.seed).choice(times, members)
            if not options.ensemble:
                drawn = spread(options.spread, members)
            share = Run(drawn, ranks, costs).simulate()
            parts = " | ".join(
                f"{100 * share[name]:.2f} %" for name in ("efficiency", "start", "waiting", "rank 0", "tail")
            )
            print(f"| {ranks} | {members} | {share['wall']:.1f} | {parts} |", flush=True)


if __name__ == "__main__":
    main()
