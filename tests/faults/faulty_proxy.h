// A link that fails to order, for whoever may not make network namespaces: connections go through a
// process in between, which cuts them or lets them fall silent after so many bytes.
#ifndef VANTAGE_TESTS_FAULTS_FAULTY_PROXY_H_
#define VANTAGE_TESTS_FAULTS_FAULTY_PROXY_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace vantage::faults {

struct LinkFault {
  enum class Kind {
    kCut,       // both ends get a reset
    kHalfOpen,  // no end is told: bytes are accepted and dropped
  };
  Kind kind = Kind::kCut;
  int64_t after_bytes = 0;  // from the client, since the fault before; of the connection that
                            // brings the last of them
};

// How long each end of a half-open connection took to give it up, s; negative: it has not.
struct Noticed {
  double client = -1;
  double server = -1;
};

class FaultyProxy {
 public:
  // Listens on a port of the system's choice on loopback; `server` is 127.0.0.1:PORT.
  FaultyProxy(const std::string& server, std::vector<LinkFault> faults);
  // Cuts everything.
  ~FaultyProxy();
  FaultyProxy(const FaultyProxy&) = delete;
  FaultyProxy& operator=(const FaultyProxy&) = delete;

  std::string address() const;

  // Faults that have happened.
  int faults() const;
  // One entry for each half-open connection. Waits until both ends have given each up, or `seconds`
  // have passed.
  std::vector<Noticed> WaitUntilNoticed(double seconds) const;

 private:
  struct Wire;
  const std::unique_ptr<Wire> wire_;
};

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_FAULTY_PROXY_H_
