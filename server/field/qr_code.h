// QR codes (ISO/IEC 18004) for terminals.
#ifndef VANTAGE_SERVER_FIELD_QR_CODE_H_
#define VANTAGE_SERVER_FIELD_QR_CODE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::field {

// The modules of a code by rows, without the margin; true is dark.
using QrModules = std::vector<std::vector<bool>>;

// The smallest code of a text of bytes, at the lowest level of correction, since screens are not
// dirty and a small code is read from further away. INVALID_ARGUMENT: it is too long for any.
absl::StatusOr<QrModules> EncodeQr(const std::string& text);

// As text of UTF-8, two rows of modules a line, with the margin of four that the norm asks for, and
// `indent` spaces before each. Its colours are its own (black on white, of the 256 that terminals
// have and nobody redefines), so that it is dark on light whatever the terminal's are.
std::string DrawQr(const QrModules& modules, int indent);

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_QR_CODE_H_
