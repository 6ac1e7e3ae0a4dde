// The checks of the fuzzer for every law, on a few random bytes; tests/fuzz/law_fuzz.cpp runs many more.
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
