// A plugin opened by the validator itself, not by the library: what the library would refuse at once must
// stay open for inspection, and its host counts what it lends.
#pragma once
#include <atomic>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "check/check.h"

namespace cli::check {

// The services of dfm_host, with a count of what is lent and the log kept.
class Host {
 public:
  Host();
  Host(const Host &) = delete;
  Host &operator=(const Host &) = delete;
  const dfm_host &table() const { return table_; }
  dfm_host &table() { return table_; }
  size_t pieces() const { return lent_.size(); }  // not yet released
  size_t not_lent() const { return not_lent_; }   // releases of what is not lent, or no longer
  const std::string &said() const { return said_; }
  void release_scratch();  // of this thread
  // How parallel_for cuts its work: by grains in order, not at all, by some grains in another order.
  enum class Cut { grains, whole, shuffled } cut = Cut::grains;
  std::atomic<uint64_t> parallel_calls{0};
  bool parallel_in_watch = false;  // a model's step may use threads; eval may not

 private:
  dfm_host table_{};
  std::map<void *, std::align_val_t> lent_;
  size_t not_lent_ = 0;
  std::string said_;
};

// What mends a table of parameters that is read where it has no rows.
inline constexpr const char *kSizeOfTable =
    "set nparam to its number of rows and param_size to sizeof(dfm_param)";

class Plugin {
 public:
  // throws Broken where it cannot be opened, refuses, or speaks another ABI
  explicit Plugin(const std::string &file);
  ~Plugin();
  Plugin(const Plugin &) = delete;
  Plugin &operator=(const Plugin &) = delete;
  // shutdown and unload; the host still knows what it lent
  void close();
  Host &host() { return host_; }
  void *image() const { return image_; }
  // full structs, as the library would copy them
  const std::vector<const dfm_type *> &types() const { return view_; }

 private:
  struct Copy {
    dfm_type type{};
    std::vector<dfm_param> rows;
    dfm_friction friction{};
    dfm_model model{};
    dfm_solver solver{};
  };
  void copy_type(const void *from, uint32_t number);
  Host host_;
  void *image_ = nullptr;
  void (*shutdown_)(void) = nullptr;
  std::vector<std::unique_ptr<Copy>> types_;
  std::vector<const dfm_type *> view_;
};

// A context of the library that has loaded no plugin; null where it cannot be had.
using BareContext = std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)>;
BareContext bare_context();
// The entry of an opened image; null where it has none.
dfm_plugin_fn entry_of(void *image);
std::string name_of(const dfm_type &type, uint32_t number);  // its id in one line, or "#0"
const dfm_friction &law_of(const Subject &subject);
bool promises(const dfm_type &type, const char *effect);

}  // namespace cli::check
