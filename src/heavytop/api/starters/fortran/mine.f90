! The heavy top by TITLE: requests on standard input, answers on standard output.
module heavy_top
  implicit none
  integer, parameter :: dp = kind(1.0d0)
  real(dp) :: inertia(3), n(3)   ! principal moments I; n = P r
  integer :: evaluations = 0
contains
  ! Omega' and gamma' of M' = M x Omega + P gamma x r, gamma' = gamma x Omega; M = I Omega
  ! xi' = xi x Omega; xi is 0 where the attitude is not asked for
  function field(y) result(f)
    real(dp), intent(in) :: y(9)
    real(dp) :: f(9), w(3), g(3)
    evaluations = evaluations + 1
    w = y(1:3)
    g = y(4:6)
    f(1) = ((inertia(2) - inertia(3)) * w(2) * w(3) + g(2) * n(3) - g(3) * n(2)) / inertia(1)
    f(2) = ((inertia(3) - inertia(1)) * w(3) * w(1) + g(3) * n(1) - g(1) * n(3)) / inertia(2)
    f(3) = ((inertia(1) - inertia(2)) * w(1) * w(2) + g(1) * n(2) - g(2) * n(1)) / inertia(3)
    f(4:6) = fixed_in_space(g, w)
    f(7:9) = fixed_in_space(y(7:9), w)
  end function

  ! the rate of a vector that is fixed in space: v x Omega
  function fixed_in_space(v, w) result(f)
    real(dp), intent(in) :: v(3), w(3)
    real(dp) :: f(3)
    f(1) = v(2) * w(3) - v(3) * w(2)
    f(2) = v(3) * w(1) - v(1) * w(3)
    f(3) = v(1) * w(2) - v(2) * w(1)
  end function

  ! METHOD
end module

program mine
  use heavy_top
  implicit none
  character(len=2000000) :: line
  character(len=40) :: name
  real(dp) :: y(9), control, t
  real(dp), allocatable :: times(:)
  integer :: count, status, i, taken, steps, width
  control = CONTROL_dp
  width = 6
  do
    read (*, '(a)', iostat=status) line
    if (status /= 0) exit
    read (line, *) name
    select case (name)
    case ('heavytop-integrator')
      print '(a)', 'ready mine 1.0'
    case ('inertia')
      read (line, *) name, inertia
    case ('moment')
      read (line, *) name, n
    case ('state')
      y = 0
      width = 9
      read (line, *, iostat=status) name, y
      if (status /= 0) then
        width = 6
        read (line, *) name, y(1:6)
        y(7:9) = 0
      end if
    case ('setting')
      read (line, *) name, control
    case ('times')
      read (line, *) name, count
      if (allocated(times)) deallocate (times)
      allocate (times(count))
      read (line, *) name, count, times
    case ('go')
      t = 0
      steps = 0
      evaluations = 0
      taken = 0
      do i = 1, count
        call advance(y, times(i) - t, control, i == 1, taken)
        if (taken < 0) exit
        t = times(i)
        steps = steps + taken
        print '(a, 10(1x, es24.16e3))', 'state', t, y(1:width)
        flush (6)
      end do
      if (taken < 0) then
        print '(a, es24.16e3)', 'failed step too small after time ', t
      else
        print '(a, i0, a, i0)', 'done steps ', steps, ' evaluations ', evaluations
      end if
    case ('quit')
      exit
    end select
    flush (6)
  end do
end program
