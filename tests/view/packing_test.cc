// Numbers packed into text and read back in the same way as by the page (apps/view/page/data.js).
#include "view/packing.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "counterpoint/model/spatial.h"
#include "view/stream_reader.h"

namespace counterpoint::view::packing_test {
namespace {

TEST(Packing, Base64OfTheStandard) {
  // RFC 4648, section 10.
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(from_base64("Zm9vYg=="), "foob");
  EXPECT_THROW(from_base64("Zm9v<"), InputError);
}

TEST(Packing, BytesComeBack) {
  std::mt19937 random(7);
  std::string bytes;
  for (int i = 0; i < 100000; ++i) bytes += static_cast<char>(random() % 7 == 0 ? random() : 0);
  EXPECT_EQ(unpack(pack(bytes)), bytes);
  EXPECT_EQ(unpack(pack("")), "");
  EXPECT_THROW(unpack(base64("no zlib")), InputError);
}

TEST(Packing, WholeNumbersComeBack) {
  const std::vector<std::int64_t> values = {
      0, -1, 1, 63, -64, 64, 127, 1ll << 40, -(1ll << 40), (1ll << 52) - 1, 5};
  IntegerStream plain, smooth, steps;
  for (const std::int64_t value : values) plain.add(value);
  smooth.add_smooth(values);
  steps.add_steps(values);
  test::StreamReader plain_reader(plain.packed()), smooth_reader(smooth.packed()),
      steps_reader(steps.packed());
  for (const std::int64_t value : values) EXPECT_EQ(plain_reader.next(), value);
  EXPECT_EQ(smooth_reader.smooth(values.size()), values);
  EXPECT_EQ(steps_reader.steps(values.size()), values);
  EXPECT_TRUE(plain_reader.at_end() && smooth_reader.at_end() && steps_reader.at_end());
}

TEST(Packing, ASmoothCurveTakesLittle) {
  std::vector<std::int64_t> fall, rest(1000, 123456);
  for (int k = 0; k < 1000; ++k) fall.push_back(1000000 - 49ll * k * k / 10);
  IntegerStream stream;
  stream.add_smooth(fall);
  stream.add_smooth(rest);
  EXPECT_LT(stream.packed().size(), 600u);  // 16 000 bytes as doubles
}

}  // namespace
}  // namespace counterpoint::view::packing_test
