# SPDX-License-Identifier: BSD-3-Clause
# pcl_libraries(out common io ...): what a test links for these modules of PCL. All but common go by file: Debian's targets lead through
# pcl_io to all of VTK, whose targets in turn cannot be used in a project without the language C and MPI.
function(pcl_libraries out)
  set(_libraries pcl_common)
  foreach(_module IN LISTS ARGN)
    list(APPEND _libraries $<TARGET_FILE:pcl_${_module}>)
  endforeach()
  set(${out} ${_libraries} PARENT_SCOPE)
endfunction()

# adapt_to_pcl(target): under AddressSanitizer Eigen's headers switch to an allocator of their own, which PCL's ready-made libraries do
# not know, although both sides free what the other one has allocated.
function(adapt_to_pcl target)
  if(GPUREG_SANITIZE MATCHES "address")
    target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  endif()
endfunction()
