// The functions of OpenGL 3.3 core that we call, as one table filled from the context: no loader library
// works with both EGL and OSMesa.
#pragma once
#include <GL/glcorearb.h>

#include <string>

#include "context.h"

// name without "gl", type of its pointer
// clang-format off
#define RENDER_GL_FUNCTIONS(X) \
  X(ActiveTexture, ACTIVETEXTURE) X(AttachShader, ATTACHSHADER) X(BindAttribLocation, BINDATTRIBLOCATION) \
  X(BindBuffer, BINDBUFFER) X(BindFramebuffer, BINDFRAMEBUFFER) X(BindRenderbuffer, BINDRENDERBUFFER) \
  X(BindTexture, BINDTEXTURE) X(BindVertexArray, BINDVERTEXARRAY) X(BlendFunc, BLENDFUNC) \
  X(BlitFramebuffer, BLITFRAMEBUFFER) X(BufferData, BUFFERDATA) \
  X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS) X(Clear, CLEAR) X(ClearColor, CLEARCOLOR) \
  X(CompileShader, COMPILESHADER) X(CreateProgram, CREATEPROGRAM) X(CreateShader, CREATESHADER) \
  X(DeleteBuffers, DELETEBUFFERS) X(DeleteFramebuffers, DELETEFRAMEBUFFERS) X(DeleteProgram, DELETEPROGRAM) \
  X(DeleteRenderbuffers, DELETERENDERBUFFERS) X(DeleteShader, DELETESHADER) \
  X(DeleteTextures, DELETETEXTURES) X(DeleteVertexArrays, DELETEVERTEXARRAYS) X(DepthFunc, DEPTHFUNC) \
  X(DepthMask, DEPTHMASK) X(Disable, DISABLE) X(DrawArrays, DRAWARRAYS) X(DrawBuffer, DRAWBUFFER) \
  X(Enable, ENABLE) X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY) \
  X(FramebufferRenderbuffer, FRAMEBUFFERRENDERBUFFER) X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D) \
  X(FramebufferTextureLayer, FRAMEBUFFERTEXTURELAYER) X(GenBuffers, GENBUFFERS) \
  X(GenFramebuffers, GENFRAMEBUFFERS) X(GenRenderbuffers, GENRENDERBUFFERS) X(GenTextures, GENTEXTURES) \
  X(GenVertexArrays, GENVERTEXARRAYS) X(GetError, GETERROR) X(GetIntegerv, GETINTEGERV) \
  X(GetProgramiv, GETPROGRAMIV) X(GetShaderInfoLog, GETSHADERINFOLOG) X(GetShaderiv, GETSHADERIV) \
  X(GetString, GETSTRING) X(GetUniformLocation, GETUNIFORMLOCATION) X(LinkProgram, LINKPROGRAM) \
  X(PixelStorei, PIXELSTOREI) X(PolygonOffset, POLYGONOFFSET) X(ReadBuffer, READBUFFER) \
  X(ReadPixels, READPIXELS) X(RenderbufferStorageMultisample, RENDERBUFFERSTORAGEMULTISAMPLE) \
  X(ShaderSource, SHADERSOURCE) X(TexImage2D, TEXIMAGE2D) X(TexImage3D, TEXIMAGE3D) \
  X(TexParameterfv, TEXPARAMETERFV) X(TexParameteri, TEXPARAMETERI) X(Uniform1f, UNIFORM1F) \
  X(Uniform1i, UNIFORM1I) X(Uniform2f, UNIFORM2F) X(Uniform3fv, UNIFORM3FV) \
  X(UniformMatrix4fv, UNIFORMMATRIX4FV) X(UseProgram, USEPROGRAM) \
  X(VertexAttribPointer, VERTEXATTRIBPOINTER) X(Viewport, VIEWPORT)
// clang-format on

namespace render {

struct Gl {
#define X(name, type) PFNGL##type##PROC name = nullptr;
  RENDER_GL_FUNCTIONS(X)
#undef X
  // The context must be current. False: *missing names the first function that the driver lacks.
  bool load(const Context &context, std::string *missing);
};

}  // namespace render
