#include <splitcubes/core/error.h>
#include <splitcubes/gl/program.h>
#include <splitcubes/gl/shader_source.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace splitcubes::gl {

namespace {

/// Returns a driver's log as one line.
std::string one_line(const std::vector<char>& log) {
    std::string line(log.data());
    std::replace(line.begin(), line.end(), '\n', ' ');
    return printable(line, 1000);
}

GLuint compile(const std::string& name, GLenum stage, std::string_view source) {
    const GLuint shader = glCreateShader(stage);
    const char* text = source.data();
    const auto length = static_cast<GLint>(source.size());
    glShaderSource(shader, 1, &text, &length);
    glCompileShader(shader);
    GLint compiled = GL_FALSE;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_TRUE) return shader;
    GLint log_length = 0;
    glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &log_length);
    std::vector<char> log(static_cast<std::size_t>(log_length) + 1, '\0');
    glGetShaderInfoLog(shader, log_length, nullptr, log.data());
    glDeleteShader(shader);
    throw JobError("shader " + name + (stage == GL_VERTEX_SHADER ? " (vertex)" : " (fragment)") +
                   " does not compile: " + one_line(log));
}

}  // namespace

Program::Program(const std::string& name, std::string_view vertex_source, std::string_view fragment_source) {
    const GLuint vertex = compile(name, GL_VERTEX_SHADER, vertex_source);
    GLuint fragment = 0;
    try {
        fragment = compile(name, GL_FRAGMENT_SHADER, fragment_source);
    } catch (...) {
        glDeleteShader(vertex);
        throw;
    }
    id_ = glCreateProgram();
    glAttachShader(id_, vertex);
    glAttachShader(id_, fragment);
    glLinkProgram(id_);
    // The linked program no longer needs the shader objects.
    glDeleteShader(vertex);
    glDeleteShader(fragment);
    GLint linked = GL_FALSE;
    glGetProgramiv(id_, GL_LINK_STATUS, &linked);
    if (linked == GL_TRUE) return;
    GLint log_length = 0;
    glGetProgramiv(id_, GL_INFO_LOG_LENGTH, &log_length);
    std::vector<char> log(static_cast<std::size_t>(log_length) + 1, '\0');
    glGetProgramInfoLog(id_, log_length, nullptr, log.data());
    glDeleteProgram(id_);
    throw JobError("shader " + name + " does not link: " + one_line(log));
}

Program Program::from_files(std::string_view vertex_file, std::string_view fragment_file,
                            std::span<const std::string> defines) {
    std::string name = std::string(vertex_file) + " + " + std::string(fragment_file);
    for (const std::string_view file : {vertex_file, fragment_file}) {
        if (shader_source(file).empty()) throw JobError("shader " + std::string(file) + " is not built in");
    }
    // The first line is the version.
    std::string fragment(shader_source(fragment_file));
    std::string lines;
    for (const std::string& define : defines) {
        lines += "#define " + define + '\n';
        name += " " + define;
    }
    fragment.insert(fragment.find('\n') + 1, lines);
    return Program(name, shader_source(vertex_file), fragment);
}

Program::~Program() {
    if (id_ != 0) glDeleteProgram(id_);
}
Program::Program(Program&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
Program& Program::operator=(Program&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
}

void Program::use() const {
    glUseProgram(id_);
}

void Program::set(const char* uniform, int value) const {
    glUniform1i(glGetUniformLocation(id_, uniform), value);
}
void Program::set(const char* uniform, float value) const {
    glUniform1f(glGetUniformLocation(id_, uniform), value);
}
void Program::set(const char* uniform, const std::array<float, 2>& value) const {
    glUniform2fv(glGetUniformLocation(id_, uniform), 1, value.data());
}
void Program::set(const char* uniform, const std::array<float, 3>& value) const {
    glUniform3fv(glGetUniformLocation(id_, uniform), 1, value.data());
}
void Program::set(const char* uniform, const std::array<float, 4>& value) const {
    glUniform4fv(glGetUniformLocation(id_, uniform), 1, value.data());
}
void Program::set(const char* uniform, const std::array<float, 16>& value) const {
    glUniformMatrix4fv(glGetUniformLocation(id_, uniform), 1, GL_FALSE, value.data());
}

}  // namespace splitcubes::gl
