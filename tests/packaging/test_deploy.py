"""What deploy/ says agrees with the service: settings, ports, probes, users, files."""

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml
from lfd_render.service.app import create_app
from lfd_render.service.settings import Settings

REPOSITORY = Path(__file__).resolve().parents[2]
DEPLOY = REPOSITORY / "deploy"
OVERLAYS = ["cpu", "nvidia", "autoscaled"]


def recipe() -> str:
    return (DEPLOY / "Containerfile").read_text(encoding="utf-8")


def deployment() -> dict[str, Any]:
    text = (DEPLOY / "kubernetes" / "base" / "deployment.yaml").read_text(encoding="utf-8")
    found: dict[str, Any] = yaml.safe_load(text)["spec"]["template"]["spec"]
    return found


def test_all_settings_are_known() -> None:
    known = {f"LFD_{name.upper()}" for name in Settings.model_fields}
    files = [path for path in DEPLOY.rglob("*") if path.is_file()]
    said = {
        name for path in files for name in re.findall(r"\bLFD_[A-Z_]+\b", path.read_text("utf-8"))
    }
    assert said
    assert said <= known


def test_the_image_has_what_it_copies() -> None:
    kept = (DEPLOY / "Containerfile.dockerignore").read_text(encoding="utf-8").splitlines()
    allowed = {line[1:] for line in kept if line.startswith("!")}
    for path in allowed:
        assert (REPOSITORY / path).exists(), path
    for source in re.findall(r"^COPY (?!--from)(\S+)", recipe(), re.MULTILINE):
        assert source == "." or source in allowed
    # The build needs every folder that the package is made of.
    packages = (REPOSITORY / "pyproject.toml").read_text(encoding="utf-8")
    folders = re.findall(r'^"lfd_render\.\w+" = "(\w+)"$', packages, re.MULTILINE)
    assert folders
    assert {*folders, "lfd_render"} <= allowed
    vendor = json.loads((DEPLOY / "10_nvidia.json").read_text(encoding="utf-8"))
    assert vendor["ICD"]["library_path"] == "libEGL_nvidia.so.0"


def test_ports_users_probes_and_times_agree() -> None:
    port = Settings.model_fields["port"].default
    (container,) = deployment()["containers"]
    (exposed,) = re.findall(r"^EXPOSE (\d+)$", recipe(), re.MULTILINE)
    assert int(exposed) == container["ports"][0]["containerPort"] == port
    (user,) = re.findall(r"--uid (\d+)", recipe())
    assert deployment()["securityContext"]["runAsUser"] == int(user)
    assert set(re.findall(r"^USER (\d+)$", recipe(), re.MULTILINE)) == {user}
    paths = create_app(Settings()).openapi()["paths"]
    probes = [
        container[f"{kind}Probe"]["httpGet"]["path"]
        for kind in ("startup", "readiness", "liveness")
    ]
    assert set(probes) <= set(paths)
    waits = int(container["lifecycle"]["preStop"]["exec"]["command"][1])
    (drain,) = [float(v["value"]) for v in container["env"] if v["name"] == "LFD_DRAIN_S"]
    assert deployment()["terminationGracePeriodSeconds"] > waits + drain


def test_compose_builds_the_targets() -> None:
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text(encoding="utf-8"))["services"]
    targets = re.findall(r"^FROM \S+ AS (\w+)$", recipe(), re.MULTILINE)
    for name, service in services.items():
        assert service["build"]["target"] == name
        assert name in targets
        assert "LFD_API_KEYS" in service["environment"]  # it would not start without


@pytest.mark.needs("kubectl")
@pytest.mark.parametrize("overlay", OVERLAYS)
def test_overlays_are_built(overlay: str) -> None:
    folder = DEPLOY / "kubernetes" / overlay
    done = subprocess.run(
        ["kubectl", "kustomize", folder], capture_output=True, text=True, check=True
    )
    (made,) = [one for one in yaml.safe_load_all(done.stdout) if one["kind"] == "Deployment"]
    (container,) = made["spec"]["template"]["spec"]["containers"]
    on_card = "nvidia.com/gpu" in container["resources"]["limits"]
    assert container["image"] == ("lfd-render:nvidia" if on_card else "lfd-render:cpu")
    assert on_card == (overlay != "cpu")
