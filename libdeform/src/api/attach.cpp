#include "deform/attach.h"

#include "api/objects.h"
#include "world/attach.h"

using namespace dfm;

dfm_status dfm_body_attach(dfm_body body, const dfm_attach_def *def, uint32_t *attachment) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    need(def, "def");
    const dfm_attach_def own = take_def(def, dfm_attach_def_default());
    check_flags(own, DFM_ATTACH_TOUCH, "dfm_attach_def");
    const bool to_body = dfm_handle_kind(own.to) == DFM_HANDLE_BODY;
    const uint32_t number =
        to_body ? attach(b, own, &body_of(own.to), nullptr) : attach(b, own, nullptr, &obstacle_of(own.to));
    if (attachment) *attachment = number;
  });
}

dfm_status dfm_body_detach(dfm_body body, uint32_t attachment) {
  return as_status([&] { detach(exclusive(body_of(body)), attachment); });
}

dfm_status dfm_body_attachments(dfm_body body, uint32_t capacity, uint32_t *out, uint32_t *n) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    std::vector<uint32_t> numbers;  // one may have several rows, where the other body has been parted
    for (const Attachment &a : b.world->attachments)
      if (a.body == b.id && !a.released && (numbers.empty() || numbers.back() != a.number))
        numbers.push_back(a.number);
    copy_list(numbers, capacity, out, n);
  });
}

dfm_status dfm_body_get_attachment(dfm_body body, uint32_t attachment, dfm_attachment *out) {
  return as_status([&] { copy_out(out, attachment_report(not_in_step(body_of(body)), attachment)); });
}
