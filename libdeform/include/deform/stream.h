/* deform/stream.h -- a scene as packets of bytes, for viewers elsewhere (format: doc/reference/stream.md). */
#ifndef DEFORM_STREAM_H
#define DEFORM_STREAM_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** dfm_stream_def.kind. SCENE: names, triangles and shapes, which a viewer needs once, and of what is new or
 * has other triangles. FRAME: where everything is now. */
enum { DFM_STREAM_SCENE = 0, DFM_STREAM_FRAME = 1 };
/** dfm_stream_def.flags, of a FRAME. FLOAT32: displacements of surfels as floats, not in 16 bits. CONTACTS:
 * with the contacts of the last sub-step that carry load. */
enum { DFM_STREAM_FLOAT32 = 1, DFM_STREAM_CONTACTS = 2 };
typedef struct dfm_stream_def {
  uint32_t size, flags; /* flags: DFM_STREAM_* */
  uint32_t kind;        /* DFM_STREAM_SCENE or FRAME */
  uint32_t frame;       /* number that the packets carry */
  /* bytes that no packet exceeds, at least 256; 0: one packet. Each packet can be read without the others */
  uint32_t packet;
  uint32_t reserved;
  dfm_body body;   /* of a SCENE: only this body, obstacle or rigid body; 0: everything */
  uint64_t cookie; /* set by the default function */
} dfm_stream_def;
/** dfm_stream_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_stream_def_default_sized(uint32_t size, dfm_stream_def *out);
/** A FRAME of number 0 in one packet, displacements in 16 bits, no contacts. Threads: Any thread.
 * Since 0.1. */
static inline dfm_stream_def dfm_stream_def_default(void) {
  dfm_stream_def out;
  dfm_stream_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Writes the present state as packets, one behind the other; bytes 16 to 19 of each are its length. A value
 * in 16 bits is off by at most 1/131070 of the range that the displacements of its packet have in that
 * direction, and by the rounding of a float.
 * @param def     NULL: the default
 * @param buffer  NULL: *bytes gets the size needed, which changes from step to step
 * @param bytes   in: of buffer; out: written
 * @return DFM_OK; DFM_E_ARG kind, packet, a body of another world, or too small a buffer (*bytes is set);
 * DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_stream(dfm_world world, const dfm_stream_def *def, void *buffer, size_t *bytes);
/** The same from a packet that dfm_world_stream has written with FLOAT32 and packet 0: the thread that steps
 * takes that one, and another one does the rest.
 * @param def  NULL: the default; its packet and FLOAT32 count
 * @return DFM_OK; DFM_E_ARG no such packet, a bad def, too small a buffer. Threads: Any thread. Since 0.1. */
DFM_API dfm_status dfm_stream_pack(const void *packet, size_t size, const dfm_stream_def *def, void *buffer,
                                   size_t *bytes);
#ifdef __cplusplus
}
#endif
#endif
