#include "other_tools.h"

#ifdef SPLITCUBES_WITH_VTK

#include <splitcubes/core/stopwatch.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSMPTools.h>
#include <vtkVersion.h>

namespace splitcubes::bench {

Timed vtk_surface(const std::vector<float>& distance, const geometry::RestGrid& grid, int threads, int runs) {
    vtkSMPTools::Initialize(threads);
    Timed out{std::string("VTK ") + vtkVersion::GetVTKVersion() + " (" + vtkSMPTools::GetBackend() + ")",
              "",
              threads,
              0,
              {"vtkFlyingEdges3D"},
              {{}}};
    vtkNew<vtkImageData> image;
    image->SetDimensions(grid.node_count[0], grid.node_count[1], grid.node_count[2]);
    image->SetSpacing(grid.cell_size, grid.cell_size, grid.cell_size);
    image->SetOrigin(grid.origin[0], grid.origin[1], grid.origin[2]);
    image->AllocateScalars(VTK_FLOAT, 1);
    std::copy(distance.begin(), distance.end(), static_cast<float*>(image->GetScalarPointer()));
    for (int run = 0; run < runs; ++run) {
        vtkNew<vtkFlyingEdges3D> filter;
        filter->SetInputData(image);
        filter->SetValue(0, 0.0);
        filter->ComputeNormalsOff();
        filter->ComputeGradientsOff();
        filter->ComputeScalarsOff();
        Stopwatch watch;
        filter->Update();
        out.seconds[0].push_back(watch.lap());
        out.triangles = static_cast<std::size_t>(filter->GetOutput()->GetNumberOfPolys());
    }
    return out;
}

}  // namespace splitcubes::bench

#else

namespace splitcubes::bench {

Timed vtk_surface(const std::vector<float>&, const geometry::RestGrid&, int threads, int) {
    return {"VTK flying edges", "not installed", threads, 0, {}, {}};
}

}  // namespace splitcubes::bench

#endif
