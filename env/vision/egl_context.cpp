#include "feeler/env/vision/egl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <fmt/format.h>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

[[noreturn]] void Fail(const char* what) {
  throw InputError("rendering", fmt::format("{} (EGL error {:#x})", what, eglGetError()),
                   "install libegl1 and libgl1-mesa-dri, or run without pictures and videos");
}

}  // namespace

EglContext::EglContext() {
  const auto get_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display == nullptr) Fail("EGL has no platform displays");
  display_ = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display_ == EGL_NO_DISPLAY) Fail("no surfaceless EGL display");
  EGLint major = 0;
  EGLint minor = 0;
  if (eglInitialize(display_, &major, &minor) != EGL_TRUE) Fail("the EGL display does not start");
  const EGLint wanted[] = {EGL_SURFACE_TYPE,    EGL_PBUFFER_BIT, EGL_RED_SIZE, 8, EGL_GREEN_SIZE, 8, EGL_BLUE_SIZE, 8,
                           EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,  EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display_, wanted, &config, 1, &count) != EGL_TRUE || count == 0) Fail("no OpenGL over EGL");
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) Fail("no desktop OpenGL over EGL");
  context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, nullptr);
  if (context_ == EGL_NO_CONTEXT) Fail("no OpenGL context");
}

// The display is shared by all contexts of the process and stays.
EglContext::~EglContext() { eglDestroyContext(display_, context_); }

EglContext::Scope::Scope(const EglContext& context) : context_(context) {
  // The bound API is a property of the thread.
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE ||
      eglMakeCurrent(context.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context.context_) != EGL_TRUE) {
    Fail("the OpenGL context cannot be used");
  }
}

EglContext::Scope::~Scope() { eglMakeCurrent(context_.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

}  // namespace feeler::env
