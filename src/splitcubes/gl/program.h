// Compiled and linked shaders.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <span>
#include <string>
#include <string_view>

namespace splitcubes::gl {

/// A linked program of the current context.
class Program {
  public:
    /// Compiles and links a program. name is used in messages. Throws JobError with the driver's log.
    Program(const std::string& name, std::string_view vertex_source, std::string_view fragment_source);
    /// Makes a program from files of shaders/, e.g. ("mesh.vert", "mesh.frag"). defines: for the fragment
    /// shader, e.g. "WITH_FINISHES" or "COLOURING 2".
    static Program from_files(std::string_view vertex_file, std::string_view fragment_file,
                              std::span<const std::string> defines = {});
    ~Program();
    Program(Program&& other) noexcept;
    Program& operator=(Program&& other) noexcept;

    /// Makes this the program of later set() calls and draws.
    void use() const;
    GLuint id() const { return id_; }

    // Set uniforms by name, on the program in use; a uniform that the compiler removed is ignored.
    void set(const char* uniform, int value) const;
    void set(const char* uniform, float value) const;
    void set(const char* uniform, const std::array<float, 2>& value) const;
    void set(const char* uniform, const std::array<float, 3>& value) const;
    void set(const char* uniform, const std::array<float, 4>& value) const;
    /// 4 x 4, column-major.
    void set(const char* uniform, const std::array<float, 16>& value) const;

  private:
    GLuint id_ = 0;
};

}  // namespace splitcubes::gl
