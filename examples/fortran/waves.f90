! Writes the arrays of a Fortran program as a .maille file, without copying them, and reads them back: hexahedra with a value on
! each point, which may be off by a thousandth.
program waves
  use maille
  implicit none

  integer, parameter :: n = 24, m = n + 1
  real(c_double), target :: positions(3, m * m * m), height(m * m * m)
  integer(c_int32_t), target :: cells(8, n * n * n)
  integer :: i, j, k, p, c
  character(1024) :: path
  type(c_ptr) :: error, mesh, options, back, values
  real(c_double), pointer :: decoded(:)

  path = 'waves.maille'
  if (command_argument_count() > 0) call get_command_argument(1, path)
  path = trim(path) // c_null_char

  do k = 0, n
    do j = 0, n
      do i = 0, n
        p = i + m * (j + m * k) + 1
        positions(:, p) = [i, j, k] / real(n, c_double)
        height(p) = sin(6 * positions(1, p)) * cos(5 * positions(2, p)) + positions(3, p)
      end do
    end do
  end do
  do k = 0, n - 1
    do j = 0, n - 1
      do i = 0, n - 1
        c = i + n * (j + n * k) + 1
        p = i + m * (j + m * k)  ! points count from 0
        cells(:, c) = [p, p + 1, p + 1 + m, p + m, p + m * m, p + 1 + m * m, p + 1 + m + m * m, p + m + m * m]
      end do
    end do
  end do

  error = maille_error_create()
  mesh = maille_mesh_create(error)
  call check(maille_mesh_set_points(mesh, maille_f64, int(m, c_int64_t)**3, c_loc(positions), maille_borrow, error))
  call check(maille_mesh_add_block(mesh, 'block' // c_null_char, maille_hexahedron, int(n, c_int64_t)**3, c_null_ptr, &
                                   c_loc(cells), 8 * int(n, c_int64_t)**3, c_null_ptr, maille_borrow, error))
  call check(maille_mesh_add_array(mesh, 'height' // c_null_char, maille_point, maille_f64, 1, int(m, c_int64_t)**3, &
                                   c_loc(height), maille_no_role, maille_borrow, error))

  options = maille_encode_options_create(error)
  call check(maille_encode_options_set_keep_order(options, 1, error))
  call check(maille_encode_options_set_bound(options, 'height' // c_null_char, maille_absolute, 1e-3_c_double, error))
  call check(maille_write_mesh(mesh, path, options, c_null_funptr, c_null_ptr, error))

  back = maille_read_mesh(path, c_null_ptr, error)
  if (.not. c_associated(back)) call check(maille_error_code(error))
  values = maille_array_values(back, maille_mesh_find(back, 'height' // c_null_char, maille_point))
  call c_f_pointer(values, decoded, [maille_mesh_points(back)])
  if (maxval(abs(decoded - height)) > 1e-3_c_double) error stop 'the bound was not kept'
  print '(i0, a, i0, a, es8.1)', maille_mesh_points(back), ' points and ', maille_mesh_cells(back), &
    ' cells came back; the largest error is ', maxval(abs(decoded - height))

  call maille_mesh_free(back)
  call maille_encode_options_free(options)
  call maille_mesh_free(mesh)
  call maille_error_free(error)

contains

  subroutine check(code)
    integer(c_int32_t), intent(in) :: code
    if (code == maille_ok) return
    print '(a)', maille_message(error)
    error stop 1
  end subroutine
end program
