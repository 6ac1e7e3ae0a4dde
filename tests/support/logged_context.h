// A context whose log a test reads.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "deform/deform.h"

namespace test {

struct LoggedContext {
  dfm_context *context = nullptr;
  std::string log;  // a sentence a line
  LoggedContext() {
    dfm_context_def def = dfm_context_def_default();
    def.user = this;
    def.log = [](void *user, int32_t, const char *text) {
      static_cast<LoggedContext *>(user)->log += std::string(text) + "\n";
    };
    EXPECT_EQ(dfm_context_create(&def, &context), DFM_OK);
  }
  ~LoggedContext() { dfm_context_destroy(context); }
  LoggedContext(const LoggedContext &) = delete;
  LoggedContext &operator=(const LoggedContext &) = delete;
};

}  // namespace test
