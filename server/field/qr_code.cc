#include "server/field/qr_code.h"

#include <qrencode.h>

#include <cstddef>
#include <memory>

#include "absl/strings/str_cat.h"

namespace vantage::field {
namespace {

constexpr int kMargin = 4;
constexpr char kBlackOnWhite[] = "\033[38;5;16;48;5;231m";
constexpr char kPlain[] = "\033[0m";
constexpr unsigned char kDark = 1;  // of a module, as the library has it

struct FreeCode {
  void operator()(QRcode* code) const { QRcode_free(code); }
};

}  // namespace

absl::StatusOr<QrModules> EncodeQr(const std::string& text) {
  const std::unique_ptr<QRcode, FreeCode> code(
      QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L));
  if (code == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("a text of ", text.size(), " bytes is too long for a QR code"));
  }
  const auto width = static_cast<size_t>(code->width);
  QrModules modules(width, std::vector<bool>(width));
  for (size_t y = 0; y < width; ++y) {
    for (size_t x = 0; x < width; ++x) modules[y][x] = (code->data[y * width + x] & kDark) != 0;
  }
  return modules;
}

std::string DrawQr(const QrModules& modules, int indent) {
  const int width = static_cast<int>(modules.size());
  const auto dark = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < width && y < width &&
           modules[static_cast<size_t>(y)][static_cast<size_t>(x)];
  };
  std::string drawn;
  for (int y = -kMargin; y < width + kMargin; y += 2) {
    absl::StrAppend(&drawn, std::string(static_cast<size_t>(indent), ' '), kBlackOnWhite);
    for (int x = -kMargin; x < width + kMargin; ++x) {
      const bool upper = dark(x, y);
      const bool lower = dark(x, y + 1);
      absl::StrAppend(&drawn, upper ? (lower ? "█" : "▀") : (lower ? "▄" : " "));
    }
    absl::StrAppend(&drawn, kPlain, "\n");
  }
  return drawn;
}

}  // namespace vantage::field
