#!/usr/bin/env python3
"""contract.py: what of proto/baseline the tree's protos no longer have as it was. For machines that
cannot have buf: needs protoc alone, looks for what breaks, and lints nothing."""

import pathlib
import subprocess
import sys
import tempfile

PROTO = pathlib.Path(__file__).resolve().parents[2] / "proto"
PACKAGES = ("vantage.v1", "vantage.storage.v1")


def decoded(encoded):
    """A FileDescriptorSet in protoc's text format."""
    return subprocess.run(
        ["protoc", "--decode=google.protobuf.FileDescriptorSet", "google/protobuf/descriptor.proto"],
        input=encoded, capture_output=True, check=True).stdout.decode()


def descriptors(text):
    """A FileDescriptorSet in text format as nested dictionaries: name -> list of values."""
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


class Promises:
    """What of a contract may not change (`said`, text -> text), and what may only grow (`reserved`,
    message or enum -> set of half-open spans of numbers)."""

    def __init__(self):
        self.said = {}
        self.reserved = {}


def promises(text):
    """The promises of a FileDescriptorSet in text format."""
    made = Promises()
    found = made.said

    def add_reserved(owner, name, last):
        # The end of a message's span is behind it, that of an enum's is its last number.
        spans = {(int(span.get("start", [0])[0]), int(span.get("end", [0])[0]) + last)
                 for span in owner.get("reserved_range", [])}
        if spans:
            made.reserved[name] = spans
        for reserved in owner.get("reserved_name", []):
            found[f"{name}, name {reserved}"] = "reserved"

    def add_enum(enum, prefix):
        name = f"{prefix}.{enum['name'][0]}"
        for value in enum["value"]:
            found[f"enum {name}, value {value['number'][0]}"] = value["name"][0]
        add_reserved(enum, f"enum {name}", 1)

    def add_message(message, prefix):
        name = f"{prefix}.{message['name'][0]}"
        found[f"message {name}"] = "there"
        oneofs = [oneof["name"][0] for oneof in message.get("oneof_decl", [])]
        for field in message.get("field", []):
            oneof = oneofs[int(field["oneof_index"][0])] if "oneof_index" in field else ""
            found[f"{name}, field {field['number'][0]}"] = " ".join(filter(None, [
                field["label"][0], field["type"][0], field.get("type_name", [""])[0],
                field["name"][0], oneof]))
        add_reserved(message, name, 0)
        for inner in message.get("nested_type", []):
            add_message(inner, name)
        for enum in message.get("enum_type", []):
            add_enum(enum, name)

    for file in descriptors(text)["file"]:
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
    return made


def released(spans, now):
    """What of `spans` is in none of `now`, as spans in order: those of `now` may have grown together
    or been split."""
    out = []
    for start, end in sorted(spans):
        for other_start, other_end in sorted(now):
            if start < end and other_end > start and other_start < end:
                if other_start > start:
                    out.append((start, other_start))
                start = other_end
        if start < end:
            out.append((start, end))
    return out


def broken(promised, now):
    """What of the promises is not kept, a line each."""
    lines = [f"{what}: was {how}, is {now.said.get(what, 'gone')}"
             for what, how in sorted(promised.said.items()) if now.said.get(what) != how]
    for name, spans in sorted(promised.reserved.items()):
        lines += [f"{name}, from {start} to {end - 1}: reserved no more"
                  for start, end in released(spans, now.reserved.get(name, set()))]
    return lines


def main():
    with tempfile.NamedTemporaryFile() as out:
        files = sorted(str(path.relative_to(PROTO)) for folder in ("v1", "storage/v1")
                       for path in (PROTO / "vantage" / folder).glob("*.proto"))
        subprocess.run(["protoc", "-I", ".", "-I", "third_party", "-o", out.name, *files],
                       cwd=PROTO, check=True)
        now = promises(decoded(pathlib.Path(out.name).read_bytes()))
    promised = promises(decoded((PROTO / "baseline" / "vantage.v1.binpb").read_bytes()))
    lines = broken(promised, now)
    count = len(promised.said) + len(promised.reserved)
    print("\n".join(lines) or f"{count} promises of the contract are kept")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
