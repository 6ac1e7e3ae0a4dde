#include "check/plugin.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <new>

#include "check/environment.h"
#include "check/image.h"
#include "check/watch.h"
#include "deform/plugin_draft.h"
#include "system.h"

namespace cli::check {
namespace {

// Scratch of one thread, taken beforehand: what eval takes is no call of the C library.
struct Arena {
  static constexpr size_t kBytes = size_t(8) << 20;
  std::unique_ptr<char[]> bytes;
  size_t used = 0;
};
thread_local Arena arena;

// The service that the library gives a plugin; it works with the memory and threads of any host.
const void *library_solver() {
  static const void *given = nullptr;
  const dfm_plugin_fn ask = [](const dfm_host *host, uint32_t, uint32_t) -> const dfm_plugin * {
    given = host->extension(host->ctx, DFM_HOST_DIRECT);
    return nullptr;
  };
  if (!given)
    if (const BareContext context = bare_context()) dfm_plugin_register_static(context.get(), ask, "ask");
  return given;
}

// Copies what both sides know of a struct that begins with its size; the rest stays zero.
template <class T>
bool copy_struct(T &full, const void *from, size_t head) {
  uint32_t size = 0;
  if (!from) return false;
  std::memcpy(&size, from, sizeof size);
  if (size < head || size > 65536) return false;
  std::memcpy(&full, from, std::min<size_t>(size, sizeof full));
  full.size = sizeof full;
  return true;
}

}  // namespace

Host::Host() {
  table_.size = sizeof table_;
  table_.abi = DFM_ABI;
  table_.abi_draft = DFM_ABI_DRAFT;
  table_.abi_min = DFM_ABI_MIN;
  table_.ctx = this;
  table_.alloc = [](void *ctx, size_t bytes, size_t align) {
    if (Watch::watching()) Watch::stop("dfm_host.alloc");
    const std::align_val_t whole{std::max(align, sizeof(void *))};
    void *p = ::operator new(bytes, whole, std::nothrow);
    if (p) static_cast<Host *>(ctx)->lent_[p] = whole;
    return p;
  };
  table_.release = [](void *ctx, void *p, size_t, size_t) {
    if (Watch::watching()) Watch::stop("dfm_host.release");
    if (!p) return;
    Host &host = *static_cast<Host *>(ctx);
    if (const auto lent = host.lent_.extract(p)) ::operator delete(p, lent.mapped());
    else ++host.not_lent_;
  };
  table_.scratch = [](void *, size_t bytes) -> void * {
    if (!arena.bytes) arena.bytes = std::make_unique_for_overwrite<char[]>(Arena::kBytes);
    const size_t begin = arena.used + (-(reinterpret_cast<uintptr_t>(arena.bytes.get()) + arena.used) & 63);
    if (bytes > Arena::kBytes || begin > Arena::kBytes - bytes) return nullptr;
    arena.used = begin + bytes;
    return arena.bytes.get() + begin;
  };
  table_.log = [](void *ctx, int32_t, uint32_t, const char *utf8) {
    if (Watch::watching()) return;
    std::string &said = static_cast<Host *>(ctx)->said_;
    if (utf8 && said.size() < 4096)
      said += (said.empty() ? "" : "; ") + std::string(utf8, strnlen(utf8, 512));
  };
  table_.parallel_for = [](void *ctx, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                           void *user) {
    Host &host = *static_cast<Host *>(ctx);
    if (Watch::watching() && !host.parallel_in_watch) Watch::stop("dfm_host.parallel_for");
    ++host.parallel_calls;
    const uint32_t piece = std::max(grain, 1u);
    if (host.cut == Cut::whole) {
      if (n) fn(user, 0, n);
      return;
    }
    if (host.cut == Cut::grains) {
      for (uint32_t begin = 0; begin < n; begin += piece) fn(user, begin, std::min(n, begin + piece));
      return;
    }
    // from the end, one to three grains at a time
    const uint32_t pieces = (n + piece - 1) / piece;
    for (uint32_t end = pieces; end > 0;) {
      const uint32_t take = std::min(end, 1 + end % 3);
      fn(user, (end - take) * piece, std::min(n, end * piece));
      end -= take;
    }
  };
  library_solver();  // before a rule watches
  table_.extension = [](void *, const char *id) {
    return id && std::strcmp(id, DFM_HOST_DIRECT) == 0 ? library_solver() : nullptr;
  };
}

void Host::release_scratch() {
  if (!arena.bytes) arena.bytes = std::make_unique_for_overwrite<char[]>(Arena::kBytes);
  arena.used = 0;
}

BareContext bare_context() {
  dfm_context *made = nullptr;
  static int number = 0;
  std::error_code error;
  const std::filesystem::path above = std::filesystem::temp_directory_path(error);
  std::filesystem::path folder;
  do folder = above / text("deform_check_%ld_%d", long(getpid()), number++);
  while (!error && !std::filesystem::create_directory(folder, error) && !error);  // another one's is there
  dfm_context_def def = dfm_context_def_default();
  if (!error) {
    const std::string name = cli::name_of(folder);
    def.plugin_dir = name.c_str();
    dfm_context_create(&def, &made);
    std::filesystem::remove(folder, error);
  }
  return {made, dfm_context_destroy};
}

dfm_plugin_fn entry_of(void *image) {
  return reinterpret_cast<dfm_plugin_fn>(symbol_of(image, "dfm_plugin_entry"));
}

Plugin::Plugin(const std::string &file) {
  std::string why;
  const Kept kept("loading it");
  image_ = load_image(file, why);
  if (!image_)
    broken("the dynamic linker refuses it: %s; link what is missing, or leave it out", why.c_str());
  const dfm_plugin_fn entry = entry_of(image_);
  if (!entry)
    broken(
        "it has no symbol dfm_plugin_entry; build it with deform_add_plugin and define the entry of "
        "deform/plugin.h");
  const dfm_plugin *given = nullptr;
  try {
    given = entry(&host_.table(), DFM_ABI, DFM_ABI_MIN);
  } catch (...) {
    broken("its entry threw an exception; catch it in the entry, log the reason, and return NULL");
  }
  if (!given)
    broken("it refuses a host of ABI %u draft %u (%s); rebuild it against this library's deform/plugin.h",
           DFM_ABI, DFM_ABI_DRAFT, host_.said().empty() ? "without a reason" : host_.said().c_str());
  if (given->abi < DFM_ABI_MIN || given->abi > DFM_ABI || given->abi_draft != DFM_ABI_DRAFT)
    broken(
        "it was built for ABI %u draft %u and accepts a host of ABI %u draft %u; rebuild it against this "
        "library's deform/plugin.h and refuse other hosts with DFM_ABI_OK",
        given->abi, given->abi_draft, DFM_ABI, DFM_ABI_DRAFT);
  dfm_plugin full{};
  if (!copy_struct(full, given, offsetof(dfm_plugin, types) + sizeof(void *)))
    broken("dfm_plugin.size is %u; set it to sizeof(dfm_plugin)", given->size);
  shutdown_ = full.shutdown;
  if (full.ntype == 0 || full.ntype > 4096 || !full.types)
    broken("it offers no types (ntype %u); name at least one dfm_type", full.ntype);
  for (uint32_t i = 0; i < full.ntype; ++i) copy_type(full.types[i], i);
}

void Plugin::copy_type(const void *from, uint32_t number) {
  auto copy = std::make_unique<Copy>();
  dfm_type &type = copy->type;
  if (!copy_struct(type, from, offsetof(dfm_type, ops) + sizeof(void *)))
    broken("type #%u is NULL or claims a size that no dfm_type has; set size to sizeof(dfm_type)", number);
  const uint32_t width = type.param_size;
  if (type.params && type.nparam <= 4096 && width >= offsetof(dfm_param, names) && width <= 65536)
    for (uint32_t i = 0; i < type.nparam; ++i) {
      dfm_param row{};
      const char *const at = reinterpret_cast<const char *>(type.params) + size_t(i) * width;
      const std::string fault =
          Fenced::guard([&] { std::memcpy(&row, at, std::min<size_t>(width, sizeof row)); });
      if (!fault.empty())
        broken("type #%u: row %u of nparam %u of its parameter table lies outside its memory; %s", number,
               i + 1, type.nparam, kSizeOfTable);
      copy->rows.push_back(row);
    }
  const auto lies_outside = [&](const char *what) {
    broken("type #%u: its %s lies outside of its memory; point to text that ends with a 0", number, what);
  };
  const volatile char *byte = type.id;
  if (!Fenced::guard([&] {
         while (byte && *byte) ++byte;
       }).empty())
    lies_outside("id");
  const char *const *effect = type.effects;
  if (!Fenced::guard([&] {
         for (; effect && *effect; ++effect)
           for (byte = *effect; *byte;) ++byte;
       }).empty())
    lies_outside("list of effects");
  if (copy->rows.size() != type.nparam)
    broken(
        "type #%u: its table has %u rows of %u bytes at %p; set params, nparam and param_size "
        "(sizeof(dfm_param))",
        number, type.nparam, width, static_cast<const void *>(type.params));
  type.params = copy->rows.data();
  type.param_size = sizeof(dfm_param);
  const void *ops = type.ops;
  const void *full = nullptr;
  const auto take = [&](uint32_t kind, auto &as, size_t head) {
    if (type.kind == kind && copy_struct(as, ops, uint32_t(head + sizeof(void *)))) full = &as;
  };
  take(DFM_KIND_FRICTION, copy->friction, offsetof(dfm_friction, eval));
  take(DFM_KIND_MODEL, copy->model, offsetof(dfm_model, destroy));
  take(DFM_KIND_SOLVER, copy->solver, offsetof(dfm_solver, release));
  if (!full)
    broken(
        "type #%u has kind %u and operations that do not fit it; set kind, and ops.size to the sizeof of its "
        "struct",
        number, type.kind);
  type.ops = full;
  types_.push_back(std::move(copy));
  view_.push_back(&types_.back()->type);
}

void Plugin::close() {
  view_.clear();
  types_.clear();
  const Kept kept("unloading it");
  if (shutdown_) shutdown_();
  if (image_) unload_image(image_);
  shutdown_ = nullptr;
  image_ = nullptr;
}

Plugin::~Plugin() { close(); }

std::string name_of(const dfm_type &type, uint32_t number) {
  std::string name = type.id && *type.id ? type.id : "#" + std::to_string(number);
  std::replace_if(name.begin(), name.end(), [](unsigned char c) { return c < 32 || c == 127; }, '?');
  return name;
}

const dfm_friction &law_of(const Subject &subject) {
  return *static_cast<const dfm_friction *>(subject.type->ops);
}

bool promises(const dfm_type &type, const char *effect) {
  for (const char *const *e = type.effects; e && *e; ++e)
    if (std::strcmp(*e, effect) == 0) return true;
  return false;
}

}  // namespace cli::check
