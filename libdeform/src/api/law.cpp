#include "deform/law.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <vector>

#include "api/objects.h"
#include "core/system.h"
#include "plugin/call.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "step/stages.h"

namespace dfm {
namespace {

// Result of prepare() for one set of parameters; released with the last evaluation that uses it.
struct Prepared {
  const dfm_host &host;
  const dfm_type &type;
  std::vector<double> params;
  void *data = nullptr;
  Prepared(const dfm_host &h, const dfm_type &t, const double *values)
      : host(h), type(t), params(values, values + packed_width(t)) {
    const dfm_status status =
        call_plugin(host, type, "prepare", [&] { return law_of(type).prepare(&host, params.data(), &data); });
    if (status != DFM_OK)
      fail(status < 0 ? status : DFM_E_FATAL, "law %s could not prepare its tables (%s)", type.id,
           dfm_status_name(status));
  }
  ~Prepared() {
    call_plugin(host, type, "release", [&] { law_of(type).release(&host, data); });
  }
  Prepared(const Prepared &) = delete;
};

struct Law {
  dfm_context &context;
  const dfm_type &type;
  std::mutex mutex;
  // for the last parameters: a rig or plot calls repeatedly with the same ones
  std::shared_ptr<const Prepared> prepared;

  std::shared_ptr<const Prepared> prepare(const double *params) {
    const std::lock_guard lock(mutex);
    if (!prepared || !std::equal(prepared->params.begin(), prepared->params.end(), params))
      prepared = std::make_shared<const Prepared>(context.host, type, params);
    return prepared;
  }
};

Law &law_at(dfm_law handle) {
  Law &law = resolve<Law>(Kind::law, handle);
  return held(law, law.context);
}

uint32_t state_width(const Law &law, const double *params) {
  const dfm_friction &ops = law_of(law.type);
  uint32_t n = 0;
  const auto add = [&n](std::span<const dfm_slot> slots) {
    for (const dfm_slot &slot : slots) n += slot.width;
  };
  if (ops.state) add(law_slots(law.type, law.context.host, params));
  else add({ops.slots, ops.nslot});  // needs no memory
  return n;
}

const dfm_type &type_from_file(dfm_context &context, const char *path) {
  exclusive(context).loader.load(path);
  std::vector<const dfm_type *> laws;
  std::vector<std::string> ids;
  for (const dfm_type *type : context.loader.types_of(path))
    if (type->kind == DFM_KIND_FRICTION) {
      laws.push_back(type);
      ids.push_back(type->id);
    }
  if (laws.empty()) fail(DFM_E_UNSUPPORTED, "%s holds no friction law", path);
  if (laws.size() > 1)
    fail(DFM_E_ARG, "%s holds several laws, open one by its id: %s", path, join(ids).c_str());
  return *laws[0];
}

// ---- evaluation -------------------------------------------------------------------------------------------

void check_input(const Law &law, const dfm_friction_in &in) {
  const dfm_friction &ops = law_of(law.type);
  const char *id = law.type.id;
  if (in.stride < in.n) fail(DFM_E_ARG, "dfm_law_eval (%s): stride %u is below n %u", id, in.stride, in.n);
  if (!(in.dt >= 0) || !std::isfinite(in.dt))
    fail(DFM_E_ARG, "dfm_law_eval (%s): dt is %g, a time in s expected", id, in.dt);
  if (law.type.nparam && !in.params)
    fail(DFM_E_ARG, "dfm_law_eval (%s): params is NULL; fill them with dfm_law_pack", id);
  const struct {
    const double *given;
    bool needed;
    const char *name;
  } columns[] = {{in.fn, bool(ops.needs & DFM_NEED_FN), "fn"},
                 {in.vt, bool(ops.needs & DFM_NEED_VT), "vt"},
                 {in.ft_stop, bool(ops.needs & DFM_NEED_FT_STOP), "ft_stop"},
                 {in.area, bool(ops.needs & DFM_NEED_AREA), "area"},
                 {in.dwell, bool(ops.needs & DFM_NEED_DWELL), "dwell"}};
  for (const auto &column : columns)
    if (column.needed && !column.given)
      fail(DFM_E_ARG, "dfm_law_eval (%s): the law needs %s, which is NULL", id, column.name);
}

// f(column, width) for the columns of a batch, and f(column of one, column of the other, width).
template <class F>
void each_in(dfm_friction_in &in, uint32_t nstate, F &&f) {
  f(in.fn, 1u);
  f(in.vt, 2u);
  f(in.ft_stop, 2u);
  f(in.area, 1u);
  f(in.dwell, 1u);
  f(in.state, nstate);
}
template <class F>
void each_out(const dfm_friction_out &a, dfm_friction_out &b, uint32_t nstate, F &&f) {
  f(a.ft, b.ft, 2u);
  f(a.state, b.state, nstate);
  f(a.dft_dvt, b.dft_dvt, 4u);
  f(a.dft_dfn, b.dft_dfn, 2u);
  f(a.limit, b.limit, 1u);
  f(a.mode, b.mode, 1u);
  f(a.stored, b.stored, 1u);
}

// Plugins may rely on 64-byte alignment and a stride of whole vectors; callers may pass plain arrays.
class Aligned {
 public:
  Aligned(dfm_context &context, const dfm_friction_in &in, const dfm_friction_out &out, uint32_t nstate)
      : arena_(context.scratch.arena()),
        in_(in),
        out_(out),
        given_(out),
        nstate_(nstate),
        stride_((in.n + 7) & ~7u) {
    bool aligned = in.stride % 8 == 0;
    const auto look = [&](const void *p) { aligned &= reinterpret_cast<uintptr_t>(p) % 64 == 0; };
    each_in(in_, nstate, [&](auto *p, uint32_t) { look(p); });
    each_out(given_, out_, nstate, [&](auto *p, auto *, uint32_t) { look(p); });
    if (aligned) return;
    copied_ = true;
    from_ = in.stride;
    in_.stride = stride_;
    each_in(in_, nstate, [&](const double *&column, uint32_t width) {
      if (!column) return;
      double *const to = take<double>(width);
      for (uint32_t c = 0; c < width; ++c)
        std::copy_n(column + size_t(c) * from_, in_.n, to + size_t(c) * stride_);
      column = to;
    });
    each_out(given_, out_, nstate, [&]<class T>(T *, T *&column, uint32_t width) {
      if (column) column = take<T>(width);
    });
  }
  const dfm_friction_in *in() const { return &in_; }
  dfm_friction_out *out() { return &out_; }
  void finish() {
    if (!copied_) return;
    each_out(given_, out_, nstate_, [&](auto *to, const auto *column, uint32_t width) {
      for (uint32_t c = 0; to && c < width; ++c)
        std::copy_n(column + size_t(c) * stride_, in_.n, to + size_t(c) * from_);
    });
  }

 private:
  template <class T>
  T *take(uint32_t width) const {
    const size_t bytes = sizeof(T) * stride_ * width;
    void *p = arena_ ? arena_->take(bytes) : nullptr;
    if (!p) throw std::bad_alloc();
    std::memset(p, 0, bytes);
    return static_cast<T *>(p);
  }

  ScratchArena *arena_;
  dfm_friction_in in_;
  dfm_friction_out out_, given_;
  uint32_t nstate_, stride_, from_ = 0;
  bool copied_ = false;
};

bool finite(const double *column, uint32_t width, uint32_t stride, uint32_t n) {
  double nan_flag = 0;
  for (uint32_t c = 0; column && c < width; ++c)
    for (uint32_t i = 0; i < n; ++i) nan_flag += 0.0 * column[size_t(c) * stride + i];
  return nan_flag == 0;
}

bool finite(const dfm_friction_in &in, const dfm_friction_out &out, uint32_t nstate) {
  bool limits = true;
  for (uint32_t i = 0; out.limit && i < in.n; ++i) limits &= out.limit[i] >= 0;  // +inf: no limit
  return limits && finite(out.ft, 2, in.stride, in.n) && finite(out.state, nstate, in.stride, in.n) &&
         finite(out.dft_dvt, 4, in.stride, in.n) && finite(out.dft_dfn, 2, in.stride, in.n) &&
         finite(out.stored, 1, in.stride, in.n);
}

template <class T>
T full(const T *given, uint32_t head, const char *name) {
  if (!given) fail(DFM_E_ARG, "dfm_law_eval: %s is NULL", name);
  if (given->size < head)
    fail(DFM_E_ARG, "dfm_law_eval: %s.size is %u, at least %u expected; set it to sizeof", name, given->size,
         head);
  T copy{};
  std::memcpy(&copy, given, std::min<size_t>(given->size, sizeof copy));
  copy.size = sizeof copy;
  return copy;
}

dfm_status evaluate(Law &law, const dfm_friction_in *given_in, dfm_friction_out *given_out) {
  dfm_friction_in in = full(given_in, offsetof(dfm_friction_in, fn), "dfm_friction_in");
  const dfm_friction_out out = full(given_out, offsetof(dfm_friction_out, state), "dfm_friction_out");
  check_input(law, in);
  if (in.n == 0) return DFM_OK;
  const dfm_friction &ops = law_of(law.type);
  const std::shared_ptr<const Prepared> prepared = ops.prepare ? law.prepare(in.params) : nullptr;
  in.data = prepared ? prepared->data : nullptr;
  const PluginCall scratch(law.context.scratch);
  const uint32_t nstate = state_width(law, in.params);
  if (nstate && !in.state)
    fail(DFM_E_ARG, "dfm_law_eval (%s): the law needs state, which is NULL", law.type.id);
  Aligned batch(law.context, in, out, nstate);
  const dfm_status status =
      call_plugin(law.context.host, law.type, "eval", [&] { return ops.eval(batch.in(), batch.out()); });
  if (status < 0) fail(status, "law %s failed with %s", law.type.id, dfm_status_name(status));
  batch.finish();
  if (status == DFM_OK && !finite(*batch.in(), *batch.out(), nstate)) {
    law.context.warn("%s: eval wrote a value that is not finite; the batch is discarded", law.type.id);
    return DFM_DISCARD;
  }
  return status;
}

}  // namespace
}  // namespace dfm

using namespace dfm;

dfm_status dfm_law_open(dfm_context *context, const char *id_or_path, dfm_law *out) {
  return as_status([&] {
    if (!context || !id_or_path || !*id_or_path || !out)
      fail(DFM_E_ARG, "dfm_law_open: context, name and out are needed");
    const std::string name = id_or_path;
    const bool path = name.find_first_of("/\\") != std::string::npos || name.ends_with(os::kPluginEnding);
    used(*context);
    const dfm_type &type =
        path ? type_from_file(*context, id_or_path) : context->registry.find(DFM_KIND_FRICTION, name);
    std::unique_ptr<Law> law(new Law{*context, type, {}, nullptr});
    *out = keep_live(*context, Kind::law, std::move(law), end_live<Kind::law, Law>);
  });
}

dfm_status dfm_law_close(dfm_law law) {
  return as_status(law_at, law, [&](Law &l) {
    Call::now().need_alone(&l, "law");
    l.context.remove_live(law);
    end_live<Kind::law, Law>(law);
  });
}

dfm_status dfm_law_type(dfm_law law, const dfm_type **out) {
  return as_status([&] {
    need(out, "out");
    *out = &law_at(law).type;
  });
}

dfm_status dfm_law_eval(dfm_law law, const dfm_friction_in *in, dfm_friction_out *out) {
  return as_status([&] { return evaluate(law_at(law), in, out); });
}

dfm_status dfm_law_pack(dfm_law law, const dfm_params *params, uint32_t capacity, double *values,
                        uint32_t *n) {
  return as_status([&] {
    if (params && params->n && !params->values) fail(DFM_E_ARG, "dfm_law_pack: params.values is NULL");
    const Law &l = law_at(law);
    const std::vector<double> packed = pack_params(
        l.type, params ? std::span(params->values, params->n) : std::span<const dfm_param_value>());
    copy_list(packed, capacity, values, n);
  });
}
