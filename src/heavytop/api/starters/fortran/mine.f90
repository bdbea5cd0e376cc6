! The heavy top by the classical Runge-Kutta method: requests on standard input, answers on standard output.
module heavy_top
  implicit none
  integer, parameter :: dp = kind(1.0d0)
  real(dp) :: inertia(3), n(3)   ! principal moments I; n = P r
contains
  ! Omega' and gamma' of M' = M x Omega + P gamma x r, gamma' = gamma x Omega; M = I Omega
  ! xi' = xi x Omega; xi is 0 where the attitude is not asked for
  function field(y) result(f)
    real(dp), intent(in) :: y(9)
    real(dp) :: f(9), w(3), g(3)
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

  ! y after one step of size h: replace this by your method
  function step(y, h) result(z)
    real(dp), intent(in) :: y(9), h
    real(dp) :: z(9), k1(9), k2(9), k3(9), k4(9)
    k1 = field(y)
    k2 = field(y + h / 2 * k1)
    k3 = field(y + h / 2 * k2)
    k4 = field(y + h * k3)
    z = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
  end function
end module

program mine
  use heavy_top
  implicit none
  character(len=2000000) :: line
  character(len=40) :: name
  real(dp) :: y(9), h, t, length
  real(dp), allocatable :: times(:)
  integer :: count, status, i, k, parts, steps, width
  h = 0.01_dp
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
      read (line, *) name, h
    case ('times')
      read (line, *) name, count
      if (allocated(times)) deallocate (times)
      allocate (times(count))
      read (line, *) name, count, times
    case ('go')
      t = 0
      steps = 0
      do i = 1, count
        parts = ceiling(abs(times(i) - t) / h)
        if (parts > 0) length = (times(i) - t) / parts
        do k = 1, parts
          y = step(y, length)
        end do
        t = times(i)
        steps = steps + parts
        print '(a, 10(1x, es24.16e3))', 'state', t, y(1:width)
        flush (6)
      end do
      print '(a, i0, a, i0)', 'done steps ', steps, ' evaluations ', 4 * steps
    case ('quit')
      exit
    end select
    flush (6)
  end do
end program
