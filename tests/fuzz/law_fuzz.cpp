// Any bytes as a law, its parameters and what happens to eight contacts (support/law_bytes.h): answers are
// finite and within their limit, and no work comes from nowhere.
#include "../support/law_bytes.h"
#include "fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  const std::string wrong = law_bytes::complaint(fuzz::context(), data, size);
  if (!wrong.empty()) {
    std::fprintf(stderr, "%s\n", wrong.c_str());
    std::abort();
  }
  return 0;
}
