// What the fuzzer asks of every law, from random bytes: tests/fuzz/law_fuzz.cpp goes on where this ends.
#include "law_bytes.h"

#include <random>

#include "world.h"

namespace {

TEST(LawBytes, AnyParametersAndMotions_GiveFiniteBoundedPassiveResults) {
  const test::Context c;
  std::mt19937 random(3);
  for (uint32_t law = 0; law < std::size(law_bytes::kLaws); ++law)
    for (int n = 0; n < 1500; ++n) {
      std::vector<uint8_t> bytes(1200);
      for (uint8_t &b : bytes) b = uint8_t(random());
      bytes[0] = uint8_t(law);
      const std::string wrong = law_bytes::complaint(c, bytes.data(), bytes.size());
      ASSERT_EQ(wrong, "") << "input " << n;
    }
}

}  // namespace
