// A stand-in for `vantaged --web`, for working on the page: serves the built page and, at the same
// origin, every unary and server-streaming RPC over the Connect protocol, by calling a server over
// gRPC. Generic from the service descriptors, so it knows no RPC by name.
//
//   node dev/bridge.mjs --server 127.0.0.1:7464 [--listen 127.0.0.1:8080] [--page ../../build/web]
import { createReadStream, existsSync, readFileSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { createFileRegistry, fromBinary } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";
import { ConnectError, createClient } from "@connectrpc/connect";
import { connectNodeAdapter, createGrpcTransport } from "@connectrpc/connect-node";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const { values: options } = parseArgs({
  options: {
    server: { type: "string", default: "127.0.0.1:7464" },
    listen: { type: "string", default: "127.0.0.1:8080" },
    page: { type: "string", default: here("../../../build/web") },
  },
});

const registry = createFileRegistry(
  fromBinary(FileDescriptorSetSchema, readFileSync(here("../../../proto/baseline/vantage.v1.binpb"))),
);
const transport = createGrpcTransport({ baseUrl: `http://${options.server}` });

// What a caller says of itself goes along; all else in the headers is between the two ends.
const passedOn = (headers) => {
  const authorization = headers.get("authorization");
  return authorization === null ? {} : { authorization };
};

// The server's error without the headers that it came with, which are of another protocol.
function asOurs(error) {
  const theirs = ConnectError.from(error);
  const ours = new ConnectError(theirs.rawMessage, theirs.code);
  ours.details = theirs.details;
  return ours;
}

const rpc = connectNodeAdapter({
  routes(router) {
    for (const type of registry) {
      if (type.kind !== "service" || !type.typeName.startsWith("vantage.v1.")) continue;
      const client = createClient(type, transport);
      const methods = {};
      for (const method of type.methods) {
        const call = client[method.localName];
        const options = (context) => ({ signal: context.signal, headers: passedOn(context.requestHeader) });
        if (method.methodKind === "unary") {
          methods[method.localName] = async (request, context) => {
            try {
              return await call(request, options(context));
            } catch (error) {
              throw asOurs(error);
            }
          };
        } else if (method.methodKind === "server_streaming") {
          methods[method.localName] = async function* (request, context) {
            try {
              yield* call(request, options(context));
            } catch (error) {
              throw asOurs(error);
            }
          };
        }
      }
      router.service(type, methods);
    }
  },
  fallback: servePage,
});

const types = {
  ".css": "text/css; charset=utf-8",
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript; charset=utf-8",
  ".json": "application/json",
  ".svg": "image/svg+xml",
};

function servePage(request, response) {
  const path = normalize(new URL(request.url, "http://page").pathname);
  let file = join(options.page, path);
  if (!existsSync(file) || !statSync(file).isFile()) file = join(options.page, "index.html");
  if (!existsSync(file)) {
    response.writeHead(404).end("no page here yet: ./dev build web");
    return;
  }
  response.writeHead(200, {
    "content-type": types[extname(file)] ?? "application/octet-stream",
    "cache-control": file.includes("/assets/") ? "max-age=31536000, immutable" : "no-cache",
    "content-security-policy": "default-src 'self'; img-src 'self' blob: data:; worker-src 'self' blob:",
  });
  createReadStream(file).pipe(response);
}

const [, host, port] = /^(.*):(\d+)$/.exec(options.listen) ?? [];
if (port === undefined) throw new Error(`--listen takes HOST:PORT, not '${options.listen}'`);
const server = createServer(rpc).listen(Number(port), host, () => {
  // The port that was taken, for scripts that asked for any.
  console.log(`http://${host}:${server.address().port}`);
});
