#pragma once

namespace feeler::env {

/// An OpenGL context without a window or screen. MuJoCo's renderer draws into off-screen buffers in it.
class EglContext {
 public:
  /// Throws InputError with what is missing.
  EglContext();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Makes the context current on this thread while it lives. Nothing else may be current on the thread.
  class Scope {
   public:
    explicit Scope(const EglContext& context);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    const EglContext& context_;
  };

 private:
  void* display_;
  void* context_;
};

}  // namespace feeler::env
