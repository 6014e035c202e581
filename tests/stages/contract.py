#!/usr/bin/env python3
"""contract.py: what of proto/baseline the tree's protos no longer have as it was. For machines that
cannot have buf: needs protoc alone, looks for what breaks, and lints nothing."""

import pathlib
import subprocess
import sys
import tempfile

PROTO = pathlib.Path(__file__).resolve().parents[2] / "proto"
PACKAGES = ("vantage.v1", "vantage.storage.v1")


def descriptors(encoded):
    """A FileDescriptorSet as nested dictionaries: name -> list of values."""
    text = subprocess.run(
        ["protoc", "--decode=google.protobuf.FileDescriptorSet", "google/protobuf/descriptor.proto"],
        input=encoded, capture_output=True, check=True).stdout.decode()
    stack = [{}]
    for line in map(str.strip, text.splitlines()):
        if line.endswith("{"):
            inner = {}
            stack[-1].setdefault(line[:-1].strip(), []).append(inner)
            stack.append(inner)
        elif line == "}":
            stack.pop()
        elif line:
            name, value = line.split(": ", 1)
            stack[-1].setdefault(name, []).append(value.strip('"'))
    return stack[0]


def promises(encoded):
    """Everything that may not change, as text -> text."""
    found = {}

    def add_enum(enum, prefix):
        name = f"{prefix}.{enum['name'][0]}"
        for value in enum["value"]:
            found[f"enum {name}, value {value['number'][0]}"] = value["name"][0]

    def add_message(message, prefix):
        name = f"{prefix}.{message['name'][0]}"
        found[f"message {name}"] = "there"
        oneofs = [oneof["name"][0] for oneof in message.get("oneof_decl", [])]
        for field in message.get("field", []):
            oneof = oneofs[int(field["oneof_index"][0])] if "oneof_index" in field else ""
            found[f"{name}, field {field['number'][0]}"] = " ".join(filter(None, [
                field["label"][0], field["type"][0], field.get("type_name", [""])[0],
                field["name"][0], oneof]))
        for span in message.get("reserved_range", []):
            found[f"{name}, numbers {span['start'][0]} to {span['end'][0]}"] = "reserved"
        for reserved in message.get("reserved_name", []):
            found[f"{name}, name {reserved}"] = "reserved"
        for inner in message.get("nested_type", []):
            add_message(inner, name)
        for enum in message.get("enum_type", []):
            add_enum(enum, name)

    for file in descriptors(encoded)["file"]:
        package = file.get("package", [""])[0]
        if package not in PACKAGES:
            continue
        for message in file.get("message_type", []):
            add_message(message, package)
        for enum in file.get("enum_type", []):
            add_enum(enum, package)
        for service in file.get("service", []):
            for rpc in service.get("method", []):
                found[f"rpc {package}.{service['name'][0]}.{rpc['name'][0]}"] = " ".join(
                    [rpc["input_type"][0], rpc["output_type"][0]] +
                    [kind for kind in ("client_streaming", "server_streaming") if kind in rpc])
    return found


def main():
    with tempfile.NamedTemporaryFile() as out:
        files = sorted(str(path.relative_to(PROTO)) for folder in ("v1", "storage/v1")
                       for path in (PROTO / "vantage" / folder).glob("*.proto"))
        subprocess.run(["protoc", "-I", ".", "-I", "third_party", "-o", out.name, *files],
                       cwd=PROTO, check=True)
        now = promises(pathlib.Path(out.name).read_bytes())
    promised = promises((PROTO / "baseline" / "vantage.v1.binpb").read_bytes())
    broken = [f"{what}: was {how}, is {now.get(what, 'gone')}"
              for what, how in sorted(promised.items()) if now.get(what) != how]
    print("\n".join(broken) or f"{len(promised)} promises of the contract are kept")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
