// The server that the page came from: one client for each service, at the page's own address.
import { createClient, type Interceptor } from "@connectrpc/connect";
import { createConnectTransport } from "@connectrpc/connect-web";
import { FleetService } from "../gen/vantage/v1/fleet_service_pb";
import { ModelService } from "../gen/vantage/v1/model_service_pb";
import { PlanService } from "../gen/vantage/v1/plan_service_pb";
import { ScanService } from "../gen/vantage/v1/scan_service_pb";
import { SessionService } from "../gen/vantage/v1/session_service_pb";
import { token } from "./token";

const authorise: Interceptor = (next) => (request) => {
  const bearer = token();
  if (bearer !== null) request.header.set("authorization", `Bearer ${bearer}`);
  return next(request);
};

const transport = createConnectTransport({
  baseUrl: new URL(".", document.baseURI).href.replace(/\/$/, ""),
  useBinaryFormat: true,
  interceptors: [authorise],
});

export const sessions = createClient(SessionService, transport);
export const scans = createClient(ScanService, transport);
export const plans = createClient(PlanService, transport);
export const fleet = createClient(FleetService, transport);
export const models = createClient(ModelService, transport);

// Patience with a call that should be answered at once, ms.
export const patience = 15_000;

// Names an intent, so that sending it twice does it once. Works without a secure context, where
// crypto.randomUUID is missing: a server at the site may have no certificate.
export function newRequestId(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return `page-${Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("")}`;
}

// 'sessions/flat/scans/scan-1' to 'scan-1'.
export function lastPart(name: string): string {
  return name.slice(name.lastIndexOf("/") + 1);
}
