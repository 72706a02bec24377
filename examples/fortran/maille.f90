! The functions of maille.h that the example uses, for Fortran 2003. Others are declared in the same way: objects are type(c_ptr),
! uint64_t is integer(c_int64_t), and so on. What they do stands in maille.h.
module maille
  use, intrinsic :: iso_c_binding
  implicit none

  integer(c_int32_t), parameter :: maille_ok = 0, maille_f64 = 9, maille_point = 0, maille_no_role = 0
  integer(c_int32_t), parameter :: maille_hexahedron = 12, maille_absolute = 1, maille_borrow = 1

  interface
    type(c_ptr) function maille_error_create() bind(c)
      import
    end function
    subroutine maille_error_free(error) bind(c)
      import
      type(c_ptr), value :: error
    end subroutine
    integer(c_int32_t) function maille_error_code(error) bind(c)
      import
      type(c_ptr), value :: error
    end function
    type(c_ptr) function maille_error_message(error) bind(c)
      import
      type(c_ptr), value :: error
    end function

    type(c_ptr) function maille_mesh_create(error) bind(c)
      import
      type(c_ptr), value :: error
    end function
    subroutine maille_mesh_free(mesh) bind(c)
      import
      type(c_ptr), value :: mesh
    end subroutine
    integer(c_int32_t) function maille_mesh_set_points(mesh, type, count, positions, how, error) bind(c)
      import
      type(c_ptr), value :: mesh, positions, error
      integer(c_int32_t), value :: type, how
      integer(c_int64_t), value :: count
    end function
    integer(c_int32_t) function maille_mesh_add_block(mesh, name, cell_type, cells, offsets, connectivity, entries, types, how, &
        error) bind(c)
      import
      type(c_ptr), value :: mesh, offsets, connectivity, types, error
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: cell_type, how
      integer(c_int64_t), value :: cells, entries
    end function
    integer(c_int32_t) function maille_mesh_add_array(mesh, name, domain, type, components, tuples, values, role, how, error) &
        bind(c)
      import
      type(c_ptr), value :: mesh, values, error
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: domain, type, components, role, how
      integer(c_int64_t), value :: tuples
    end function
    integer(c_int64_t) function maille_mesh_points(mesh) bind(c)
      import
      type(c_ptr), value :: mesh
    end function
    integer(c_int64_t) function maille_mesh_cells(mesh) bind(c)
      import
      type(c_ptr), value :: mesh
    end function
    integer(c_int64_t) function maille_mesh_find(mesh, name, domain) bind(c)
      import
      type(c_ptr), value :: mesh
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: domain
    end function
    type(c_ptr) function maille_array_values(mesh, array) bind(c)
      import
      type(c_ptr), value :: mesh
      integer(c_int64_t), value :: array
    end function

    type(c_ptr) function maille_encode_options_create(error) bind(c)
      import
      type(c_ptr), value :: error
    end function
    subroutine maille_encode_options_free(options) bind(c)
      import
      type(c_ptr), value :: options
    end subroutine
    integer(c_int32_t) function maille_encode_options_set_keep_order(options, keep, error) bind(c)
      import
      type(c_ptr), value :: options, error
      integer(c_int32_t), value :: keep
    end function
    integer(c_int32_t) function maille_encode_options_set_bound(options, array, kind, value, error) bind(c)
      import
      type(c_ptr), value :: options, error
      character(kind=c_char), intent(in) :: array(*)
      integer(c_int32_t), value :: kind
      real(c_double), value :: value
    end function
    integer(c_int32_t) function maille_write_mesh(mesh, path, options, notes, user, error) bind(c)
      import
      type(c_ptr), value :: mesh, options, user, error
      type(c_funptr), value :: notes
      character(kind=c_char), intent(in) :: path(*)
    end function
    type(c_ptr) function maille_read_mesh(path, options, error) bind(c)
      import
      type(c_ptr), value :: options, error
      character(kind=c_char), intent(in) :: path(*)
    end function
  end interface

contains

  ! The sentence of an error.
  function maille_message(error) result(text)
    type(c_ptr), intent(in) :: error
    character(:), allocatable :: text
    character(kind=c_char), pointer :: letters(:)
    integer :: i
    call c_f_pointer(maille_error_message(error), letters, [4096])
    text = ''
    do i = 1, size(letters)
      if (letters(i) == c_null_char) exit
      text = text // letters(i)
    end do
  end function
end module
