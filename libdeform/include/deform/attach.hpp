// deform/attach.hpp -- part of deform.hpp: what a body is attached to. Comments of deform/attach.h hold.
#ifndef DEFORM_ATTACH_HPP
#define DEFORM_ATTACH_HPP
#include <cstdint>
#include <span>
#include <vector>

#include "deform/attach.h"
#include "deform/result.hpp"

namespace deform {

struct AttachDef : dfm_attach_def {
  AttachDef() noexcept : dfm_attach_def(dfm_attach_def_default()) {}
};

namespace basic {

template <class E, class Self>
class BodyAttachments {
 public:
  // The number of the attachment.
  auto attach(const dfm_attach_def &def) const {
    return produce<E, uint32_t>([&](uint32_t &number) { return dfm_body_attach(body(), &def, &number); });
  }
  auto detach(uint32_t attachment) const { return E::done(dfm_body_detach(body(), attachment)); }
  auto attachments(std::span<uint32_t> out) const { return fill<E, 1>(dfm_body_attachments, body(), out); }
  auto attachments() const { return collect<E, 1>(dfm_body_attachments, body()); }
  auto attachment(uint32_t number) const {
    return produce<E, dfm_attachment>([&](dfm_attachment &a) {
      a.size = sizeof a;
      return dfm_body_get_attachment(body(), number, &a);
    });
  }

 private:
  dfm_body body() const { return static_cast<const Self &>(*this).get(); }
};

}  // namespace basic
}  // namespace deform
#endif
