#!/usr/bin/env python3
"""Checks the Kubernetes manifests: by the schema of the API, by what refers to what, and by running what they say.

usage: deploy/kubernetes/check.py [BOLIDE]      (default: target/release/bolide)
       pip install kubernetes-validate==1.34.1 for the schemas; without it PyYAML parses the files

The arguments of master and worker are run here as they stand, with folders and ports of their own and the certificates of
secrets.sh; the master's probe is asked as a kubelet asks (by address, without looking at the certificate), and a job is
run through both. Exit code 0: all is well.
"""

import base64
import json
import pathlib
import re
import ssl
import subprocess
import sys
import tempfile
import time
import urllib.request

import yaml

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
VERSION = "1.34"


def fail(message):
    sys.exit(f"check.py: {message}")


def by_schema(documents):
    try:
        import kubernetes_validate
    except ImportError:
        print(f"{len(documents)} documents parsed; no kubernetes-validate, so by no schema")
        return
    for document in documents:
        name = f"{document['kind']} {document['metadata']['name']}"
        try:
            kubernetes_validate.validate(document, VERSION, strict=True)
        except Exception as fault:  # its errors have no common class
            fail(f"{name}: {fault}")
        print(f"{name}: as the schema of Kubernetes {VERSION} has it")


def by_reference(documents):
    """What manifests name must be there."""
    named = {(d["kind"], d["metadata"]["name"]) for d in documents}
    pods = [d for d in documents if d["kind"] in ("StatefulSet", "Deployment")]
    for document in pods:
        spec = document["spec"]["template"]["spec"]
        labels = document["spec"]["template"]["metadata"]["labels"]
        if document["spec"]["selector"]["matchLabels"] != labels:
            fail(f"{document['metadata']['name']}: selects other labels than its pods have")
        volumes = {v["name"] for v in spec["volumes"]}
        volumes |= {c["metadata"]["name"] for c in document["spec"].get("volumeClaimTemplates", [])}
        for volume in spec["volumes"]:
            if "secret" in volume and ("Secret", volume["secret"]["secretName"]) not in named:
                fail(f"no secret {volume['secret']['secretName']}")
        for container in spec["initContainers"] + spec["containers"]:
            for mount in container["volumeMounts"]:
                if mount["name"] not in volumes:
                    fail(f"{container['name']} mounts {mount['name']}, which is no volume")
            ports = {p["name"] for p in container.get("ports", [])}
            for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                port = container.get(probe, {}).get("httpGet", {}).get("port")
                if port is not None and port not in ports:
                    fail(f"{probe} of {container['name']} asks port {port}, which it does not have")
    for service in (d for d in documents if d["kind"] == "Service"):
        chosen = service["spec"]["selector"]
        match = [d for d in pods if chosen.items() <= d["spec"]["template"]["metadata"]["labels"].items()]
        if len(match) != 1:
            fail(f"service {service['metadata']['name']} selects {len(match)} kinds of pods")
        ports = {p["name"] for c in match[0]["spec"]["template"]["spec"]["containers"] for p in c["ports"]}
        for port in service["spec"]["ports"]:
            if port["targetPort"] not in ports:
                fail(f"service {service['metadata']['name']}: no port {port['targetPort']}")


def container(documents, name):
    for document in documents:
        if document["kind"] in ("StatefulSet", "Deployment"):
            for candidate in document["spec"]["template"]["spec"]["containers"]:
                if candidate["name"] == name:
                    return candidate
    fail(f"no container {name}")


def wait_for(path, pattern, process):
    for _ in range(300):
        found = re.search(pattern, path.read_text())
        if found:
            return found.group(1)
        if process.poll() is not None:
            break
        time.sleep(0.1)
    fail(f"never printed {pattern!r}:\n{path.read_text()}")


def by_running(documents, bolide, folder, lab):
    """The arguments as they stand, but for folders, ports and the names that only a cluster knows."""
    for name in ("master", "worker"):
        secret = next(d for d in documents if d["kind"] == "Secret" and d["metadata"]["name"] == f"bolide-{name}")
        (folder / name).mkdir()
        for file, text in secret["data"].items():
            path = folder / name / file
            path.write_bytes(base64.b64decode(text))
            path.chmod(0o600)

    def start(name, swaps):
        arguments = container(documents, name)["args"]
        for old, new in swaps + [("/certs", str(folder / name)), ("/spool", str(folder / "spool"))]:
            arguments = [re.sub(old, new, argument) for argument in arguments]
        log = folder / f"{name}.log"
        print("$ bolide", *container(documents, name)["args"])
        with open(log, "w", encoding="utf-8") as file:
            return subprocess.Popen([bolide, *arguments], stdout=file, stderr=subprocess.STDOUT), log

    running = []
    try:
        master, log = start("master", [(r"0\.0\.0\.0:711[78]", "0.0.0.0:0")])
        running.append(master)
        port = wait_for(log, r"listening on 0\.0\.0\.0:(\d+)", master)
        page = wait_for(log, r"page: https://[^/]*:(\d+)/", master)
        # Any certificate does, as for a kubelet.
        blind = ssl.create_default_context()
        blind.check_hostname, blind.verify_mode = False, ssl.CERT_NONE
        probe = container(documents, "master")["livenessProbe"]["httpGet"]
        address = f"{probe['scheme'].lower()}://127.0.0.1:{page}{probe['path']}"
        with urllib.request.urlopen(address, context=blind, timeout=10) as answer:
            print(f"{probe['path']}: {answer.status} {answer.read().decode().strip()}")
        at = ["--master", f"127.0.0.1:{port}", "--certs"]
        worker, log = start("worker", [(r"bolide-master:7117", f"127.0.0.1:{port}"), (r"\$\(POD\)", "pod"), ("=7119", "=0")])
        running.append(worker)
        wait_for(log, "( joined )", worker)
        deck = ROOT / "tests/decks/plates-small.toml"
        digest = {}
        for way, command in (
            ("through master and worker", ["submit", deck, "--wait", *at, lab / "me"]),
            ("bolide run", ["run", deck, "--no-output"]),
        ):
            said = subprocess.run([bolide, *command, "--cycles", "40", "--json"], capture_output=True, text=True, check=False)
            if said.returncode != 0:
                fail(f"{way}: {said.stderr}")
            digest[way] = json.loads(said.stdout)["digest"]
            print(f"{way}: {digest[way]}")
        if len(set(digest.values())) != 1:
            fail("the digests differ")
        for process in (worker, master):
            process.terminate()
            if process.wait(timeout=60) != 0:
                fail(f"SIGTERM ends it with {process.returncode}")
    finally:
        for process in running:
            process.kill()
            process.wait()


def main():
    bolide = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/bolide").resolve()
    documents = list(yaml.safe_load_all((HERE / "bolide.yaml").read_text(encoding="utf-8")))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        lab = folder / "lab"
        made = subprocess.run(
            [HERE / "secrets.sh", lab], env={"PATH": "/usr/bin:/bin", "BOLIDE": str(bolide)}, capture_output=True, text=True, check=False
        )
        if made.returncode != 0:
            fail(f"secrets.sh: {made.stderr}")
        documents += [d for d in yaml.safe_load_all(made.stdout) if d]
        by_schema(documents)
        by_reference(documents)
        by_running(documents, bolide, folder, lab)
    print("check.py: all is well")


if __name__ == "__main__":
    main()
