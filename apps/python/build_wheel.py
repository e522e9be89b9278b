"""Builds the wheel of the module with CMake, for `pip install .` (PEP 517), with what Debian has alone.

The compiler works in build-python/, or in the folder that the setting build-folder names; where that has been configured,
it is built as it is: pip install . --config-settings build-folder=build
"""
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def _project(key):
    return re.search(rf'^{key} = "(.*)"$', (ROOT / "pyproject.toml").read_text(), re.M).group(1)


def _name():
    return f"{_project('name')}-{_project('version')}"


def _metadata():
    dependencies = "".join(f"Requires-Dist: {d}\n" for d in re.findall(
        r'"([^"]+)"', re.search(r"^dependencies = \[(.*)\]$", (ROOT / "pyproject.toml").read_text(), re.M).group(1)))
    return (f"Metadata-Version: 2.1\nName: {_project('name')}\nVersion: {_project('version')}\n"
            f"Summary: {_project('description')}\nRequires-Python: {_project('requires-python')}\n{dependencies}"
            "Provides-Extra: progress\nRequires-Dist: tqdm; extra == 'progress'\n"
            "Description-Content-Type: text/markdown\n\n" + (ROOT / "README.md").read_text(encoding="utf-8"))


def _tag():
    version = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{version}-{version}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _built(settings):
    """The compiled module."""
    folder = pathlib.Path((settings or {}).get("build-folder", ROOT / "build-python"))
    if not (folder / "CMakeCache.txt").exists():
        subprocess.run(["cmake", "-G", "Ninja", "-S", ROOT, "-B", folder, "-DCMAKE_BUILD_TYPE=Release",
                        "-DNEPHELE_BUILD_TESTS=OFF", f"-DPython_EXECUTABLE={sys.executable}"], check=True)
    subprocess.run(["cmake", "--build", folder, "--target", "nephele_python"], check=True)
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    module = folder / "python" / "nephele" / f"_nephele{suffix}"
    if not module.exists():
        raise SystemExit(f"error: {module} was not built; it is for another Python, or pybind11-dev is missing")
    return module


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    module = _built(config_settings)
    name = f"{_name()}-{_tag()}.whl"
    record = []
    with tempfile.TemporaryDirectory() as temporary, \
            zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        def add(path, data):
            wheel.writestr(zipfile.ZipInfo(path, (2020, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{path},sha256={digest},{len(data)}\n")

        stripped = os.path.join(temporary, module.name)
        shutil.copy(module, stripped)
        subprocess.run(["strip", "--strip-unneeded", stripped], check=True)
        add("nephele/" + module.name, pathlib.Path(stripped).read_bytes())
        for source in sorted((ROOT / "apps/python/nephele").iterdir()):
            if source.suffix in (".py", ".pyi") or source.name == "py.typed":
                add("nephele/" + source.name, source.read_bytes())
        info = _name() + ".dist-info/"
        add(info + "METADATA", _metadata().encode())
        add(info + "LICENSE", (ROOT / "LICENSE").read_bytes())
        add(info + "NOTICE", (ROOT / "NOTICE").read_bytes())
        add(info + "WHEEL", f"Wheel-Version: 1.0\nGenerator: nephele\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode())
        wheel.writestr(info + "RECORD", "".join(record) + f"{info}RECORD,,\n")
    return name


def build_sdist(sdist_directory, config_settings=None):
    name = f"{_name()}.tar.gz"
    subprocess.run(["git", "-C", ROOT, "archive", "--format=tar.gz", f"--prefix={_name()}/", "-o",
                    os.path.join(os.path.abspath(sdist_directory), name), "HEAD"], check=True)
    return name


def get_requires_for_build_wheel(config_settings=None):
    return []


if __name__ == "__main__":
    print(build_wheel(sys.argv[1], {"build-folder": sys.argv[2]} if len(sys.argv) > 2 else None))
