#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Rebuilds the coefficients of the confidence and its record from their inputs: makes or finds every
scene of the manifest, runs `gpureg batch` on each, fits, and writes
src/confidence/confidence_model.hpp and bench/results/confidence.json.

Manifest: `scenes` by name, each with its building and one source: `data` (a folder under --data),
`generate` (options of `gpureg generate`, with `mesh`: on that mesh), or `from`, `script` and
`options` (a script of bench/accuracy on another scene). `meshes`: a script of bench/accuracy and its
options, or a file of a public repository at a commit and options of gazebo_building.py. `runs`: groups with scenes, seeds, voxel size (metres),
viewpoints (known, origin, none), label (row of the table), and role: `fit` (all regressions),
`beside` (the probability that a pose is correct), `tested` (none).

Scenes, meshes and results are kept under --work. An interrupted rebuild goes on where it stopped. A
result is made again when the recipe of its scene, its options or the command gpureg have changed.
The poses of a run depend a little on the coefficients in the command: build it again with the new
header and rebuild, until the record stays.

An input that is neither there nor can be fetched is named and ends the rebuild before anything runs.
With --only, --allow-missing or another manifest, header and record go to --work unless named.

usage: rebuild_confidence.py [--list] [--dry-run] [--only PATTERN...] [--allow-missing]
                             [--work out/confidence] [--data DIR]
Needs numpy, scikit-learn, the Python package gpureg, and for meshes git, trimesh and assimp."""

import fnmatch
import hashlib
import json
import pathlib
import shlex
import shutil
import subprocess
import sys
from typing import NamedTuple

import record

HERE = pathlib.Path(__file__).resolve().parent
MANIFEST = HERE / "confidence_manifest.json"
HEADER = record.ROOT / "src/confidence/confidence_model.hpp"
RECORD = record.ROOT / "bench/results/confidence.json"
ROLES = ("fit", "beside", "tested")
# Words of the manifest, and of the record and its tables.
VIEWPOINTS = {"known": "known", "origin": "origin", "none": "unknown"}
TRUTH = ("gt.log", "gt.info", "gt_all.log", "gt_all.info")


class Run(NamedTuple):
    scene: str
    role: str
    label: str | None
    viewpoints: str
    voxel_size: float
    seed: int

    @property
    def name(self):
        return f"{self.scene}, voxels of {self.voxel_size:g} m, seed {self.seed}"

    @property
    def file(self):
        return f"{self.scene.replace('/', '_')}_{self.voxel_size:g}m_{self.seed}"


def runs_of(manifest):
    return [
        Run(
            scene,
            group["role"],
            group.get("label"),
            group["viewpoints"],
            group["voxel_size"],
            seed,
        )
        for group in manifest["runs"]
        for seed in group["seeds"]
        for scene in group["scenes"]
    ]


def check(manifest):
    """Complaints about a manifest; none where every run can be made."""
    complaints, names = [], set()
    scenes, meshes = manifest["scenes"], manifest["meshes"]
    for name, scene in scenes.items():
        sources = [key for key in ("data", "generate", "from") if key in scene]
        if len(sources) != 1:
            complaints.append(f"scene {name}: expected one of data, generate, from")
        if "building" not in scene:
            complaints.append(f"scene {name}: no building")
        if "mesh" in scene and scene["mesh"] not in meshes:
            complaints.append(f"scene {name}: there is no mesh {scene['mesh']}")
        if "from" in scene and scene["from"] not in scenes:
            complaints.append(f"scene {name}: there is no scene {scene['from']}")
        if "from" in scene and not (HERE / scene["script"]).exists():
            complaints.append(f"scene {name}: there is no script {scene['script']}")
    for name, mesh in meshes.items():
        keys = ("options",) if "script" in mesh else ("repository", "commit", "world")
        complaints += [f"mesh {name}: no {key}" for key in keys if key not in mesh]
        if "script" in mesh and not (HERE / mesh["script"]).exists():
            complaints.append(f"mesh {name}: there is no script {mesh['script']}")
    for run in runs_of(manifest):
        if run.name in names:
            complaints.append(f"run {run.name}: twice")
        names.add(run.name)
        if run.scene not in scenes:
            complaints.append(f"run {run.name}: there is no such scene")
        if run.role not in ROLES:
            complaints.append(f"run {run.name}: the role is {run.role}, not one of {ROLES}")
        if run.viewpoints not in VIEWPOINTS:
            complaints.append(f"run {run.name}: viewpoints {run.viewpoints}")
    return complaints


class Inputs:
    """Files of the manifest's entries, and the commands that make them."""

    def __init__(self, arguments, manifest):
        self.arguments, self.manifest, self.work = arguments, manifest, arguments.work
        self._build = None

    def build(self):
        """Says which command gpureg it is."""
        if self._build is None:
            self._build = hashlib.sha256(self.arguments.gpureg.read_bytes()).hexdigest()
        return self._build

    def checkout(self, mesh):
        name = self.manifest["meshes"][mesh]["repository"].split("/")[1]
        return self.work / "checkouts" / name

    def mesh(self, name):
        return self.work / "meshes" / f"{name}.ply"

    def scene(self, name):
        scene = self.manifest["scenes"][name]
        if "data" not in scene:
            return self.work / "scenes" / name
        return pathlib.Path(self.arguments.data or "GPUREG_DATA_DIR") / scene["data"]

    def result(self, run):
        return self.work / "results" / f"{run.file}.json"

    def mesh_command(self, name, out):
        mesh = self.manifest["meshes"][name]
        if "script" in mesh:
            return [sys.executable, HERE / mesh["script"], *mesh["options"], "-o", out]
        checkout = self.checkout(name)
        models = [checkout / folder for folder in mesh.get("models", [])]
        words = [sys.executable, HERE / "buildings/gazebo_building.py", checkout / mesh["world"]]
        words += ["--models", *models] if models else []
        return [*words, *mesh.get("options", []), "-o", out]

    def scene_command(self, name, out):
        """None where the scene is data."""
        scene = self.manifest["scenes"][name]
        if "from" in scene:
            script = [sys.executable, HERE / scene["script"]]
            return [*script, self.scene(scene["from"]), out, *scene["options"]]
        if "generate" in scene:
            words = [self.arguments.gpureg, "generate", out, "--quiet", *scene["generate"]]
            return words + (["--building", self.mesh(scene["mesh"])] if "mesh" in scene else [])
        return None

    def batch_command(self, run):
        result = self.result(run)
        words = [self.arguments.gpureg, "batch", self.scene(run.scene), "--preset", "default"]
        words += ["--voxel-size", run.voxel_size, "--seed", run.seed, "--quiet"]
        words += ["--backend", self.arguments.backend]
        return [*words, "-o", result.with_suffix(".log"), "--json", result]

    def recipe(self, scene):
        """All entries that a scene is made from."""
        own = self.manifest["scenes"][scene]
        mesh = {"mesh": self.manifest["meshes"][own["mesh"]]} if "mesh" in own else {}
        source = {"from": self.recipe(own["from"])} if "from" in own else {}
        return {**own, **mesh, **source}

    def needed(self, runs):
        """Names of scenes in the order in which they can be made."""
        out = []

        def add(name):
            source = self.manifest["scenes"][name].get("from")
            if source:
                add(source)
            if name not in out:
                out.append(name)

        for run in runs:
            add(run.scene)
        return out


def stamped(path):
    stamp = path.with_name(path.name + ".made_from")
    return json.loads(stamp.read_text()) if stamp.exists() else None


def stamp(path, content):
    path.with_name(path.name + ".made_from").write_text(json.dumps(content, indent=1) + "\n")


def done(inputs, run):
    """The result is there and was made from today's recipe by this command."""
    made = stamped(inputs.result(run))
    if made is None or not inputs.result(run).exists():
        return False
    wanted = origin_of(inputs, run)
    if inputs.arguments.reuse_results:
        made, wanted = ({**of, "build": None} for of in (made, wanted))
    return made == wanted


def origin_of(inputs, run):
    return {
        "scene": inputs.recipe(run.scene),
        "voxel_size": run.voxel_size,
        "seed": run.seed,
        "build": inputs.build(),
    }


def made(inputs, name):
    """The scene is there and was made from today's recipe."""
    folder = inputs.scene(name)
    if inputs.scene_command(name, folder) is None:
        return True
    return folder.is_dir() and stamped(folder) == inputs.recipe(name)


def call(words, what):
    print(what, flush=True)
    finished = subprocess.run(list(map(str, words)))
    if finished.returncode not in (0, 1):  # 1: no pair is aligned, which is a result
        sys.exit(f"error: {what}: exit status {finished.returncode}")
    return finished.returncode == 0


def fetch(inputs, mesh):
    """Whether the file of the mesh is there, perhaps after a download."""
    of, folder = inputs.manifest["meshes"][mesh], inputs.checkout(mesh)
    if not folder.is_dir():
        address = f"https://github.com/{of['repository']}"
        print(f"fetching {address}", flush=True)
        folder.parent.mkdir(parents=True, exist_ok=True)
        words = ["git", "clone", "-q", address, str(folder)]
        if subprocess.run(words, capture_output=True).returncode != 0:
            return False
        subprocess.run(["git", "-C", str(folder), "checkout", "-q", of["commit"]], check=True)
    return (folder / of["world"]).exists()


def missing(inputs, runs):
    """Inputs that cannot be had, by the scene that needs them."""
    out = {}
    for name in inputs.needed(runs):
        scene = inputs.manifest["scenes"][name]
        if "data" in scene:
            folder = inputs.scene(name)
            if gone := [file for file in TRUTH if not (folder / file).exists()]:
                out[name] = f"data: {folder} has no {gone[0]}"
        elif "from" in scene and scene["from"] in out:
            out[name] = out[scene["from"]]
        elif "mesh" in scene and not made(inputs, name) and not inputs.mesh(scene["mesh"]).exists():
            of = inputs.manifest["meshes"][scene["mesh"]]
            if "script" in of:
                continue
            if not fetch(inputs, scene["mesh"]):
                out[name] = f"mesh: {of['repository']}@{of['commit']} {of['world']}"
            elif shutil.which("assimp") is None:
                out[name] = "the command assimp (Debian's assimp-utils)"
    return out


def make_scene(inputs, name):
    if made(inputs, name):
        return
    scene, folder = inputs.manifest["scenes"][name], inputs.scene(name)
    if "mesh" in scene and not inputs.mesh(scene["mesh"]).exists():
        mesh = inputs.mesh(scene["mesh"])
        mesh.parent.mkdir(parents=True, exist_ok=True)
        unfinished = mesh.with_name("unfinished_" + mesh.name)
        if not call(inputs.mesh_command(scene["mesh"], unfinished), f"mesh {scene['mesh']}"):
            sys.exit(f"error: mesh {scene['mesh']} could not be made")
        unfinished.rename(mesh)
    # A scene that was interrupted has no stamp.
    shutil.rmtree(folder, ignore_errors=True)
    folder.with_name(folder.name + ".made_from").unlink(missing_ok=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    if not call(inputs.scene_command(name, folder), f"scene {name}"):
        sys.exit(f"error: scene {name} could not be made")
    stamp(folder, inputs.recipe(name))


def make_result(inputs, run):
    if done(inputs, run):
        return
    result = inputs.result(run)
    result.parent.mkdir(parents=True, exist_ok=True)
    begun, origin = result.with_suffix(".begun"), origin_of(inputs, run)
    goes_on = (
        begun.exists() and stamped(begun) == origin and result.with_suffix(".log.journal").exists()
    )
    begun.touch()
    stamp(begun, origin)
    call(
        [*inputs.batch_command(run), "--resume" if goes_on else "--restart"],
        f"run {run.name}",
    )
    stamp(result, origin)


def fit(inputs, runs, absent, arguments):
    import fit_confidence

    from confidence import model_header  # needs numpy

    def load(role):
        return fit_confidence.parallel(
            fit_confidence.Run,
            [
                (
                    inputs.manifest["scenes"][run.scene]["building"],
                    inputs.scene(run.scene),
                    inputs.result(run),
                    run.label,
                    VIEWPOINTS[run.viewpoints],
                )
                for run in runs
                if run.role == role
            ],
        )

    fitted, beside, others = map(load, ROLES)
    if arguments.domains:
        import fit_models

        files = sorted(arguments.domains.glob("*.json"))
        domains = [run for file in files for run in fit_models.domain_runs(file)]
        for run in domains:
            run.weight = 1.0  # every kind counts the same
        fitted += [run for run in domains if not run.model]
    tested, models = fit_confidence.test_and_fit(fitted, beside, others)
    model_header.write_header(arguments.header, models)
    print(f"written: {arguments.header}")
    content = {"missing": sorted(absent), "runs": tested}
    words = ["bench/accuracy/rebuild_confidence.py"]
    words += ["--manifest", arguments.manifest.name] if arguments.manifest != MANIFEST else []
    words += ["--only", *arguments.only] if arguments.only else []
    record.write(arguments, shlex.join(words), content)


def parse():
    parser = record.parser(__doc__, "confidence.json")
    parser.add_argument("--manifest", type=pathlib.Path, default=MANIFEST)
    parser.add_argument("--work", type=pathlib.Path, default=record.ROOT / "out/confidence")
    parser.add_argument("--only", nargs="+", metavar="PATTERN", help="of names, see --list")
    parser.add_argument("--list", action="store_true", help="name the runs, and end")
    parser.add_argument("--dry-run", action="store_true", help="print the commands, and end")
    parser.add_argument("--allow-missing", action="store_true", help="fit without missing inputs")
    parser.add_argument(
        "--reuse-results", action="store_true", help="also those of other builds of gpureg"
    )
    parser.add_argument(
        "--domains", type=pathlib.Path, help="files of domains.py --domains street,hall,objects"
    )
    parser.add_argument("--header", type=pathlib.Path)
    parser.set_defaults(output=None)
    return parser.parse_args()


def chosen(runs, patterns):
    if not patterns:
        return runs
    return [run for run in runs if any(fnmatch.fnmatch(run.name, p) for p in patterns)]


def print_commands(inputs, runs):
    for name in inputs.needed(runs):
        scene = inputs.manifest["scenes"][name]
        if "mesh" in scene:
            mesh = scene["mesh"]
            print(shlex.join(map(str, inputs.mesh_command(mesh, inputs.mesh(mesh)))))
        command = inputs.scene_command(name, inputs.scene(name))
        if command:
            print(shlex.join(map(str, command)))
    for run in runs:
        print(shlex.join(map(str, inputs.batch_command(run))))


def main():
    arguments = parse()
    manifest = json.loads(arguments.manifest.read_text())
    if complaints := check(manifest):
        sys.exit("\n".join(f"error: {arguments.manifest}: {text}" for text in complaints))
    inputs = Inputs(arguments, manifest)
    runs = chosen(runs_of(manifest), arguments.only)
    if not runs:
        sys.exit(f"error: no run has a name like {' '.join(arguments.only)}, see --list")
    if arguments.dry_run:
        return print_commands(inputs, runs)
    if not arguments.gpureg.exists():
        sys.exit(f"error: there is no command {arguments.gpureg}: build it, or name it by --gpureg")
    if arguments.list:
        for run in runs:
            state = "done" if done(inputs, run) else "to do"
            print(
                f"{state:6} {run.role:7} {run.viewpoints:7} {run.name}: {run.label or 'as it is'}"
            )
        return None
    absent = missing(inputs, runs)
    for name, why in absent.items():
        print(f"missing: {name}: {why}", file=sys.stderr)
    if absent and not arguments.allow_missing:
        sys.exit("error: inputs are missing; --allow-missing fits without them")
    whole = not (absent or arguments.only or arguments.manifest != MANIFEST)
    arguments.header = arguments.header or (HEADER if whole else arguments.work / HEADER.name)
    arguments.output = arguments.output or (RECORD if whole else arguments.work / RECORD.name)
    runs = [run for run in runs if run.scene not in absent]
    for name in inputs.needed(runs):
        make_scene(inputs, name)
    for run in runs:
        make_result(inputs, run)
    fit(inputs, runs, absent, arguments)
    return None


if __name__ == "__main__":
    main()
