#include "opengl_backend.h"

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/core/error.h>
#include <splitcubes/occlusion_gl/opengl_backend.h>
#endif

namespace splitcubes::app {

decltype(body::BodySettings::make_visibility_backend) opengl_backend_maker(bool wanted) {
    if (!wanted) return {};
#ifdef SPLITCUBES_WITH_RENDER
    std::string why_not;
    auto made = gl::HeadlessContext::create(&why_not);
    if (!made) throw JobError("occlusion by OpenGL cannot start: " + why_not + "; take --occlusion cpu");
    const auto context = std::make_shared<const gl::HeadlessContext>(std::move(*made));
    return [context](const occlusion::VisibilityOptions& options) {
        return std::make_unique<occlusion::OpenGlBackend>(context, options);
    };
#else
    return {};
#endif
}

}  // namespace splitcubes::app
