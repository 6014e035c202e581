#include "client/cli/picture_storey.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;

google::protobuf::RepeatedPtrField<v1::Storey> House() {
  google::protobuf::RepeatedPtrField<v1::Storey> storeys;
  const double floors[] = {-2.7, 0, 3};
  for (int i = 0; i < 3; ++i) {
    v1::Storey& storey = *storeys.Add();
    storey.set_number(i);
    storey.set_floor_z_m(floors[i]);
    if (i == 0) storey.set_name("cellar");
  }
  return storeys;
}

TEST(PictureStorey, IsFoundByNumberAndByName) {
  for (const char* wanted : {"0", "cellar"}) {
    const auto cellar = ChooseStorey(House(), wanted, 4.5);
    ASSERT_TRUE(cellar.ok()) << cellar.status();
    EXPECT_TRUE(cellar->HasStation(-1.2));
    EXPECT_FALSE(cellar->HasStation(1.5));
    EXPECT_TRUE(cellar->HasSurface(-2.7));
    EXPECT_FALSE(cellar->HasSurface(0));
  }
  const auto top = ChooseStorey(House(), "2", std::nullopt);
  ASSERT_TRUE(top.ok());
  EXPECT_TRUE(top->HasSurface(50));
}

TEST(PictureStorey, WithoutAWordIsThatOfTheLastScan) {
  EXPECT_EQ(ChooseStorey(House(), "", 1.5)->storey->number(), 1);
  EXPECT_EQ(ChooseStorey(House(), "", 4.5)->storey->number(), 2);
  EXPECT_FALSE(ChooseStorey(House(), "", std::nullopt)->storey.has_value());
  google::protobuf::RepeatedPtrField<v1::Storey> one;
  one.Add()->set_floor_z_m(0);
  const auto all = ChooseStorey(one, "", 1.5);
  EXPECT_FALSE(all->storey.has_value());
  EXPECT_TRUE(all->HasSurface(-50));
}

TEST(PictureStorey, ThatThereIsNotNamesThoseThatThereAre) {
  const auto none = ChooseStorey(House(), "attic", 1.5);
  EXPECT_TRUE(absl::IsNotFound(none.status()));
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("'attic'"));
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("0 (cellar), 1, 2"));
  EXPECT_THAT(std::string(ChooseStorey({}, "0", std::nullopt).status().message()),
              HasSubstr("no scan is in the model"));
}

}  // namespace
}  // namespace vantage::cli
