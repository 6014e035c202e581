"""A gRPC client that knows a service by its reflection alone, without our protos or stubs."""

import grpc
from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory


def reflection_pool():
    """The messages of grpc.reflection.v1alpha that are needed, built by hand."""
    field = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(
        name="reflection.proto", package="grpc.reflection.v1alpha", syntax="proto3")

    def message(name, *fields):
        made = file.message_type.add(name=name)
        for number, field_name, kind, label, type_name in fields:
            made.field.add(number=number, name=field_name, type=kind, label=label,
                           type_name=type_name)

    one, many = field.LABEL_OPTIONAL, field.LABEL_REPEATED
    message("ServerReflectionRequest", (4, "file_containing_symbol", field.TYPE_STRING, one, None),
            (7, "list_services", field.TYPE_STRING, one, None))
    message("FileDescriptorResponse", (1, "file_descriptor_proto", field.TYPE_BYTES, many, None))
    message("ServiceResponse", (1, "name", field.TYPE_STRING, one, None))
    message("ListServiceResponse", (1, "service", field.TYPE_MESSAGE, many,
                                    ".grpc.reflection.v1alpha.ServiceResponse"))
    message("ServerReflectionResponse",
            (4, "file_descriptor_response", field.TYPE_MESSAGE, one,
             ".grpc.reflection.v1alpha.FileDescriptorResponse"),
            (6, "list_services_response", field.TYPE_MESSAGE, one,
             ".grpc.reflection.v1alpha.ListServiceResponse"))
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return pool


def message_class(pool, name):
    return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))


class Reflected:
    """A channel whose methods are known from the server's own description."""

    def __init__(self, channel, metadata=()):
        """`metadata` goes with every call."""
        self.channel, self.metadata = channel, metadata
        pool = reflection_pool()
        self.request = message_class(pool, "grpc.reflection.v1alpha.ServerReflectionRequest")
        response = message_class(pool, "grpc.reflection.v1alpha.ServerReflectionResponse")
        self.ask_stream = channel.stream_stream(
            "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
            request_serializer=self.request.SerializeToString,
            response_deserializer=response.FromString)
        self.pool = descriptor_pool.DescriptorPool()
        self.files = {}
        self.described = set()

    def ask(self, **what):
        return next(iter(self.ask_stream(iter([self.request(**what)]))))

    def services(self):
        listed = self.ask(list_services="*").list_services_response.service
        return sorted(service.name for service in listed)

    def describe(self, symbol):
        raw = self.ask(file_containing_symbol=symbol).file_descriptor_response.file_descriptor_proto
        assert raw, f"{symbol} cannot be described"
        for data in raw:
            file = descriptor_pb2.FileDescriptorProto.FromString(data)
            self.files.setdefault(file.name, file)
        added = set()

        def add(name):
            if name in added:
                return
            added.add(name)
            for dependency in self.files[name].dependency:
                add(dependency)
            try:
                self.pool.FindFileByName(name)
            except KeyError:
                self.pool.Add(self.files[name])

        for name in list(self.files):
            add(name)
        return self.pool.FindServiceByName(symbol)

    def method(self, service, name):
        """Its path, the class of its request and that of its response."""
        if service not in self.described:
            self.describe(service)
            self.described.add(service)
        method = self.pool.FindServiceByName(service).FindMethodByName(name)
        return (f"/{service}/{name}", message_class(self.pool, method.input_type.full_name),
                message_class(self.pool, method.output_type.full_name))

    def call(self, service, method, body, timeout=30):
        """`body`: the request as Protobuf's JSON mapping has it."""
        path, request, response = self.method(service, method)
        unary = self.channel.unary_unary(
            path, request_serializer=request.SerializeToString,
            response_deserializer=response.FromString)
        return unary(json_format.ParseDict(body, request()), timeout=timeout,
                     metadata=self.metadata)

    def watch(self, service, method, body, timeout=60):
        """The messages of a server's stream, as they come."""
        path, request, response = self.method(service, method)
        stream = self.channel.unary_stream(
            path, request_serializer=request.SerializeToString,
            response_deserializer=response.FromString)
        return stream(json_format.ParseDict(body, request()), timeout=timeout,
                      metadata=self.metadata)


def error_of(call):
    try:
        call()
    except grpc.RpcError as error:
        details = dict((key, value) for key, value in error.trailing_metadata() or ())
        return error.code(), error.details(), details
    raise AssertionError("the call succeeded")
