#include "server/contract/valid_text.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "vantage/v1/upload.pb.h"

namespace vantage::contract {
namespace {

TEST(ValidText, KeepsWhatIsTextAndNothingElse) {
  EXPECT_EQ(ValidText("Küche № 3 \xF0\x9F\x8F\xA0", 100), "Küche № 3 \xF0\x9F\x8F\xA0");
  EXPECT_EQ(ValidText("a\nb\x1b[31m", 100), "a b [31m");
  // Longer forms than needed, surrogates, beyond the last character, cut off.
  EXPECT_EQ(ValidText("\xC0\xAF \xED\xA0\x80 \xF4\x90\x80\x80 \xC3", 100), "?? ??? ???? ?");
  EXPECT_EQ(ValidText("Küche", 2), "K");
  EXPECT_EQ(ValidText("", 5), "");
}

// Whatever the bytes are, Protobuf takes them.
TEST(ValidText, IsAlwaysReadByProtobuf) {
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(1 + random() % 20, '\0');
    for (char& c : bytes)
      c = static_cast<char>(random() % 3 == 0 ? random() : 0xC0 + random() % 64);
    v1::Upload upload;
    upload.set_display_name(ValidText(bytes, 12));
    EXPECT_LE(upload.display_name().size(), 12U);
    v1::Upload read;
    EXPECT_TRUE(read.ParseFromString(upload.SerializeAsString())) << i;
  }
}

}  // namespace
}  // namespace vantage::contract
