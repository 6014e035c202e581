#!/usr/bin/python3
"""Makes the contract's messages and stubs: stubs.py PROTO_FOLDER TO.

They come below the package `vantage` and bring nothing that another package may have, too: the
annotations of google.api are left out, which say nothing to a client, and google.rpc's error
details, which every error of the server carries, become vantage.google.rpc. So the wheel stands
beside googleapis-common-protos of any version, and needs none.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

from google.protobuf import descriptor_pb2

ERRORS = ("google/rpc/status.proto", "google/rpc/error_details.proto")


def moved(name):
    """A file or type of google.rpc, as it is called in the wheel."""
    return re.sub(r"^(\.?)google([/.])rpc\b", r"\1vantage\2google\2rpc", name)


def of_the_wheel(message):
    """Takes google.api's options from a message and those inside it, and moves google.rpc's."""
    if not message.options.map_entry:
        message.ClearField("options")
    for field in message.field:
        field.ClearField("options")
        if field.type_name:
            field.type_name = moved(field.type_name)
    for nested in message.nested_type:
        of_the_wheel(nested)


def file_of_the_wheel(file):
    without = [name for name in file.dependency if not name.startswith("google/api/")]
    del file.dependency[:]
    file.dependency.extend(map(moved, without))
    file.name, file.package = moved(file.name), moved(file.package)
    for message in file.message_type:
        of_the_wheel(message)


def main():
    protos, to = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    files = sorted(str(path.relative_to(protos)) for path in protos.glob("vantage/v1/*.proto"))
    files += ERRORS
    with tempfile.TemporaryDirectory() as folder:
        described = pathlib.Path(folder, "contract.binpb")
        subprocess.run(["protoc", f"-I{protos}", f"-I{protos / 'third_party'}", "--include_imports",
                        f"--descriptor_set_out={described}", *files], check=True)
        contract = descriptor_pb2.FileDescriptorSet.FromString(described.read_bytes())
        kept = [file for file in contract.file if not file.name.startswith("google/api/")]
        for file in kept:
            if file.name in files:
                file_of_the_wheel(file)
        described.write_bytes(descriptor_pb2.FileDescriptorSet(file=kept).SerializeToString())
        made = [moved(name) for name in files]
        services = [name for name in made if name.endswith("_service.proto")]
        common = ["protoc", f"--descriptor_set_in={described}"]
        to.mkdir(parents=True, exist_ok=True)
        subprocess.run([*common, f"--python_out={to}", f"--pyi_out={to}", *made], check=True)
        subprocess.run([*common, f"--grpc_out={to}",
                        "--plugin=protoc-gen-grpc=/usr/bin/grpc_python_plugin", *services],
                       check=True)
    for package in ("vantage/v1", "vantage/google", "vantage/google/rpc"):
        (to / package / "__init__.py").touch()


if __name__ == "__main__":
    main()
