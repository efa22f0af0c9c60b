"""Loopbench in Python: right-hand sides, motions and stores as numpy and pandas objects.

    import loopbench
    four_bar = loopbench.Mechanism("configs/mechanisms/four-bar.json")
    derivative = four_bar.compile("odca")                # generated C, compiled with cc
    print(derivative(0.0, derivative.start))             # numpy array
    motion = four_bar.simulate(10, "odca", rtol=1e-9)    # pandas frame, indexed by time
    runs = loopbench.read_store("out")                   # a row per case

The module calls the program `loopbench`: $LOOPBENCH, or the one in $PATH.
"""
import ctypes
import json
import os
import pathlib
import re
import subprocess
import tempfile

import numpy as np
import pandas as pd


class Error(RuntimeError):
    """A command failed; the text is its message."""


def _call(program, *arguments):
    try:
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    except OSError as error:
        raise Error(f"{program}: cannot be run: {error.strerror}") from None
    if done.returncode != 0:
        raise Error(done.stderr.strip() or f"{program} ended with status {done.returncode}")


def _run(*arguments):
    _call(os.environ.get("LOOPBENCH", "loopbench"), *arguments)


class Mechanism:
    """A mechanism file, checked."""

    def __init__(self, path):
        self.path = pathlib.Path(path).resolve()
        _run("check", self.path)

    def compile(self, formulation="lagrange", enforcement="acceleration", horizon=10.0, cc="cc"):
        """Returns the right-hand side as compiled code (docs/generated-code.md).

        `horizon` [s]: the motion whose branches the code contains.
        """
        return RightHandSide(self.path, formulation, enforcement, horizon, cc)

    def simulate(self, horizon, formulation="odca", enforcement="projection", coordinates="joint",
                 rtol=1e-8, step=None, **keys):
        """Integrates for `horizon` seconds and returns the trajectory (docs/trajectories.md).

        `step` [s]: interval of rows, by default a thousandth of the horizon. Further keys, such as
        `integrator`, are keys of experiments; `fixed_steps` replaces `rtol`. `attrs["record"]` of the frame contains drift, energy
        error, outcome and warnings. Raises Error if the run does not finish.
        """
        integrator, data = keys.get("integrator"), (keys.get("reference") or {}).get("published_data")
        if isinstance(integrator, str) and integrator.endswith(".json"):
            keys["integrator"] = str(pathlib.Path(integrator).resolve())
        if isinstance(data, str):
            keys["reference"] = {**keys["reference"], "published_data": str(pathlib.Path(data).resolve())}
        experiment = {
            "name": "python",
            "problems": [{"mechanism": str(self.path), "horizon": horizon}],
            "methods": [{"formulation": formulation, "enforcement": enforcement, "coordinates": coordinates}],
            "tolerances": [] if "fixed_steps" in keys else [rtol],
            "output": {"step": horizon / 1000 if step is None else step},
            **keys,
        }
        with tempfile.TemporaryDirectory() as folder:
            file, store = pathlib.Path(folder, "python.json"), pathlib.Path(folder, "out")
            file.write_text(json.dumps(experiment, default=lambda number: number.item()))
            _run("run", file, "--out", store, "--no-timing")
            records = read_store(store)
            records = records[records["kind"] == "accuracy"]
            if len(records) != 1:
                raise Error(f"found {len(records)} cases, expected one; `loopbench run` runs several")
            record = records.iloc[0].dropna()
            if record["outcome"] != "finished":
                raise Error(f"{record['outcome']}: {record.get('message', '')}")
            (rows,) = pathlib.Path(store, "trajectories").glob("*.csv")
            motion = pd.read_csv(rows, comment="#", index_col="t [s]")
        motion.attrs["record"] = record.to_dict()
        return motion


class RightHandSide:
    """dy/dt = f(t, y) as a function of a float and an array; y contains positions, then speeds."""

    def __init__(self, path, formulation, enforcement, horizon, cc):
        with tempfile.TemporaryDirectory() as folder:
            _run("generate", path, "--formulation", formulation, "--enforcement", enforcement,
                 "--horizon", horizon, "--out", folder)
            (source,) = set(pathlib.Path(folder).glob("*.c")) - set(pathlib.Path(folder).glob("*_example.c"))
            library = source.with_suffix(".so")
            flags = ["-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
            _call(cc, *flags, "-o", library, source, "-lm")
            self._library = ctypes.CDLL(str(library))
            self._states = int(re.search(r"_STATES = (\d+)", source.with_suffix(".h").read_text())[1])
        self._name = source.stem
        self._vector = self._array(self._states)
        self.state_names = self._texts("state_names")
        self.state_units = self._texts("state_units")
        t, self.start = ctypes.c_double(), np.zeros(self._states)
        start = getattr(self._library, self._name + "_start")
        start.argtypes = [ctypes.POINTER(ctypes.c_double), self._vector]
        start(ctypes.byref(t), self.start)
        self.start_time = t.value

    def __call__(self, t, y):
        """Returns dy/dt."""
        return self._evaluate("derivative", t, y, self._states)

    def jacobian(self, t, y):
        """Returns df/dy."""
        return self._evaluate("jacobian", t, y, self._states**2).reshape(self._states, -1).T

    def energy(self, t, y):
        """Returns kinetic and potential energy [J]."""
        return self._evaluate("energy", t, y, 2)

    def project(self, t, y):
        """Returns the state on the constraints near y."""
        function = getattr(self._library, self._name + "_project")
        function.argtypes = [ctypes.c_double, self._vector]
        y = np.array(y, dtype=float)
        if function(t, y) != 0:
            raise Error(f"no projection at t = {t}")
        return y

    @staticmethod
    def _array(size):
        return np.ctypeslib.ndpointer(dtype=float, shape=(size,), flags="C_CONTIGUOUS")

    def _texts(self, name):
        texts = (ctypes.c_char_p * self._states).in_dll(self._library, f"{self._name}_{name}")
        return [text.decode() for text in texts]

    def _evaluate(self, name, t, y, size):
        function = getattr(self._library, f"{self._name}_{name}")
        function.argtypes = [ctypes.c_double, self._vector, self._array(size)]
        result = np.empty(size)
        if function(t, np.ascontiguousarray(y, dtype=float), result) != 0:
            raise Error(f"no code for the state at t = {t}: compile with a longer horizon")
        return result


def read_store(folder):
    """Returns the records of a store, a row per case, in a column per key (docs/reference/records.md)."""
    with open(pathlib.Path(folder, "results.jsonl"), encoding="utf-8") as lines:
        return pd.json_normalize([json.loads(line) for line in lines])
