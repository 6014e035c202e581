// What most tests that see messages and gRPC include (tests/CMakeLists.txt), beside headers.h.
#ifndef VANTAGE_TESTS_PRECOMPILED_SERVICE_HEADERS_H_
#define VANTAGE_TESTS_PRECOMPILED_SERVICE_HEADERS_H_

#include <grpcpp/grpcpp.h>

#include "tests/precompiled/headers.h"
#include "vantage/v1/fleet_service.pb.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session_service.pb.h"

#endif  // VANTAGE_TESTS_PRECOMPILED_SERVICE_HEADERS_H_
