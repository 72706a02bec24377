# find_package(MailleVTK): the target MailleVTK, vtkMailleReader and vtkMailleWriter.
include(CMakeFindDependencyMacro)
find_dependency(VTK COMPONENTS CommonCore CommonDataModel CommonExecutionModel IOCore)
include(${CMAKE_CURRENT_LIST_DIR}/MailleVTK-targets.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/MailleVTK-vtk-module-properties.cmake)
