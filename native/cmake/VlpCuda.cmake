# Finds a CUDA compiler and builds backend/*.cu as the object library vlp_cuda; sets VLP_HAS_CUDA.
set(VLP_HAS_CUDA FALSE)
if(VLP_CUDA STREQUAL "OFF")
  return()
endif()
set(VLP_CUDA_ROOT "" CACHE PATH "CUDA toolkit to use; empty: CUDA_HOME, PATH, then the PyPI packages nvidia-cuda-* beside Python")

if(NOT CMAKE_CUDA_COMPILER)
  find_program(CMAKE_CUDA_COMPILER nvcc HINTS ${VLP_CUDA_ROOT} ENV CUDA_HOME PATHS ${Python_SITELIB}/nvidia/cu13 PATH_SUFFIXES bin)
endif()
include(CheckLanguage)
if(CMAKE_CUDA_COMPILER)
  check_language(CUDA) # also that it works together with this C++ compiler
endif()
if(NOT CMAKE_CUDA_COMPILER)
  if(VLP_CUDA STREQUAL "ON")
    message(FATAL_ERROR "VLP_CUDA=ON, but no working nvcc: set CUDA_HOME or VLP_CUDA_ROOT, or install the PyPI packages of the group `cuda`")
  endif()
  message(STATUS "No CUDA compiler found: building without the GPU back end")
  return()
endif()

set(CMAKE_CUDA_ARCHITECTURES ${VLP_CUDA_ARCHITECTURES})
set(CMAKE_CUDA_STANDARD 20)
set(CMAKE_CUDA_STANDARD_REQUIRED ON)
set(CMAKE_CUDA_VISIBILITY_PRESET hidden)
set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
enable_language(CUDA)
find_package(CUDAToolkit REQUIRED)

# Compiled once for all instruction sets: what crosses this border must not depend on one.
file(GLOB cuda_sources CONFIGURE_DEPENDS backend/*.cu)
add_library(vlp_cuda OBJECT ${cuda_sources})
target_compile_options(vlp_cuda PRIVATE --expt-relaxed-constexpr --extended-lambda -lineinfo -Xcompiler=-fno-math-errno,-Wall
  $<$<BOOL:${VLP_WERROR}>:-Werror=all-warnings>)
target_link_libraries(vlp_cuda PUBLIC vlp_options CUDA::cudart_static)
set(VLP_HAS_CUDA TRUE)
message(STATUS "CUDA ${CMAKE_CUDA_COMPILER_VERSION}: ${CMAKE_CUDA_COMPILER}, architectures ${VLP_CUDA_ARCHITECTURES}")
